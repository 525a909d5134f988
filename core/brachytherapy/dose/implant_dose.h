#pragma once

#include <cstddef>
#include <vector>

#include "core/brachytherapy/dose/dose_grid.h"
#include "core/brachytherapy/dose/dose_settings.h"
#include "core/brachytherapy/dose/dvh.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// The dose of an implant, seed by seed: a grid over the prostate plus margin, and the structures' share of its voxels.
/// Parts of structures outside the grid are not counted.
/// Threads: one at a time. Real-time: no; construction takes some 0.1 s, a seed and evaluate() about 1 ms each.
class ImplantDose {
 public:
  /// Structures with closed surfaces wound outward (prepare_surface); the grid is about the one called "prostate", or
  /// about the first. Errors: UserError where there is none, or the grid would be too large.
  ImplantDose(std::vector<Structure> structures, const DoseSettings& settings);

  /// One more seed; finite, its axis of unit length. `stretch`: of tissue that is and stays swollen, along x, y and z;
  /// volumes of figures are those without it.
  void add(const DoseSeed& seed, const Vec3& stretch = Vec3::Ones());
  /// One more seed in a gland that is swollen on the day of the implant and comes back to where it is now
  /// (resolving_swelling()): what the tissue gets, point for point, while it does.
  void add_while_swollen(const DoseSeed& seed, const Vec3& day_zero_stretch, double resolved_days);
  void clear();  ///< removes all seeds
  std::size_t seed_count() const { return seed_count_; }
  const DoseGrid& grid() const { return grid_; }
  const std::vector<Structure>& structures() const { return structures_; }
  /// The part of the grid's voxels that each structure fills, in the order of structures().
  const std::vector<StructureVoxels>& voxels() const { return voxels_; }
  const DoseSettings& settings() const { return settings_; }

  /// The figures of all structures, in their order, for the seeds so far.
  std::vector<StructureDose> evaluate() const;

 private:
  std::vector<Structure> structures_;
  DoseSettings settings_;
  DoseGrid grid_;
  std::vector<StructureVoxels> voxels_;  ///< of each structure
  std::size_t seed_count_ = 0;
};

}  // namespace brachy
