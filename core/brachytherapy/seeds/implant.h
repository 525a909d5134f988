#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/brachytherapy/seeds/seed.h"
#include "core/brachytherapy/seeds/seed_drop.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/injectivity/certificate.h"
#include "core/models/displacement_field.h"

namespace brachy {

/// The seeds in the body: adds new ones at their material points and moves all in the tissue with it
/// (core/DESIGN.md, section 6). None is ever removed.
/// Threads: one. Real-time: no allocation after construction and restore, no exceptions.
class Implant {
 public:
  explicit Implant(std::size_t max_count);

  /// Seeds of an earlier run, in their order, before the first tick. Throws UserError where they are too many.
  void restore(std::span<const Seed> seeds);

  /// Where a seed falls: the tissue at rest, its field and the field's verdict.
  struct Place {
    const SurfaceBvh& tissue;
    const DisplacementField& field;
    Verdict verdict;
    Vec3 material_tip;  ///< the needle's, where the search for the material point starts
    bool is_needle_in;  ///< the needle is in the tissue
  };

  /// Drops a seed: `seed` has what is known of it when it falls, `dropped` and `dropped_axis` above all. Where its
  /// material point is in the tissue it moves with it from now on; elsewhere it stays where the tip was (is_fixed).
  /// A field that is not certified marks the seed (is_certified); only one that folds at the very tip, or in which no
  /// material point is found, keeps it in a needle that is in the tissue: then returns the reason.
  DropRefusal drop(Seed seed, const Place& place) noexcept;

  /// Moves the seeds with `field`, which evaluates them together (displacements_at).
  void move(std::uint64_t tick, DisplacementField& field) noexcept;

  std::span<const Seed> seeds() const { return seeds_; }
  std::size_t max_count() const { return max_count_; }
  /// The last tick in which seed i was dropped or moved; 0: restored and at rest since.
  std::uint64_t changed_tick(std::size_t i) const { return changed_[i]; }

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(seeds_, changed_);
  }

 private:
  static constexpr std::size_t kPointsOfSeed = 3;

  std::size_t max_count_;
  std::vector<Seed> seeds_;
  std::vector<std::uint64_t> changed_;
  std::vector<Vec3> X_, u_;  // of move: the points of all seeds that move, and their displacements
};

}  // namespace brachy
