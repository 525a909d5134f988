#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/brachytherapy/structures/structure.h"
#include "core/geometry/volume/volume.h"
#include "core/ultrasound/anatomy.h"
#include "core/ultrasound/distance_grid.h"
#include "core/ultrasound/scan_loops.h"

namespace brachy {

/// What ultrasound meets at a material point: made of the scene's structures, constant.
///
/// The gland (peripheral zone, and a transition zone about the urethra that is darker and coarser), urethra, bladder,
/// bone (the pubic arch), and around them fat with fascia, and muscle. Levels in dB are of the amplitude that scatters
/// back, against the peripheral zone's. The surroundings, the zones and the calcifications are made up by anatomy
/// textbooks' proportions of the gland's box: they are no patient's.
/// Threads: const functions from any. Real-time: they do not allocate.
class EchoMap {
 public:
  /// Boundaries, by their index in EchoTissues::distance_mm. A later one lies over an earlier one.
  enum Boundary : std::size_t { kGland, kTransition, kUrethra, kBladder, kBone, kBoundaries };

  /// Of each boundary's inside: level, attenuation against soft tissue's, and how much of the pressure its surface
  /// reflects square on, in dB against the same level.
  struct Inside {
    float level_db, attenuation_share, interface_db;
  };
  static constexpr std::array<Inside, kBoundaries> kInside = {{
      {0, 1, 13},        // gland: its capsule
      {-5, 1, -90},      // transition zone: no surface of its own
      {-10, 0.6F, 3},    // urethra
      {-45, 0.01F, 14},  // bladder: urine
      {-6, 20, 30},      // bone
  }};
  static constexpr float kUrethralWallDb = 4;  ///< brighter by so much within 1.5 mm around the urethra

  /// One tissue everywhere: for tests of speckle and attenuation.
  EchoMap() = default;
  /// `structures` (load_structures) at rest, W: "prostate", and "urethra" and "bladder" where there are such. Takes up
  /// to a second. Errors: UserError where there is no prostate.
  EchoMap(const std::vector<Structure>& structures, bool has_surroundings, std::uint64_t seed);
  /// A patient's echoes, `image` at rest, W: levels are its values times `db_per_value` against their mean within the
  /// structure "prostate". All tissue attenuates alike and no surface has an echo of its own: the image has both
  /// already. Beyond its voxels nothing scatters. It is averaged to voxels of up to 1 mm, the imager's own grid.
  /// Errors: UserError where there is no prostate, or no voxel lies in it.
  EchoMap(const std::vector<Structure>& structures, const Volume& image, double db_per_value);

  /// What is at 1 to EchoTissues::kMost places.
  void at(const EchoPlaces& places, const ScanLoops& loops, EchoTissues& tissues) const noexcept;
  bool is_uniform() const { return grids_[kGland].is_empty() && !image_db_; }

 private:
  Anatomy anatomy() const noexcept;

  std::array<DistanceGrid, kBoundaries>
      grids_;  // bladder: where the scene has one; transition and bone: never
  bool has_surroundings_ = false;
  std::uint32_t seed_ = 0;
  Vec3 middle_ = Vec3::Zero(), half_ = Vec3::Ones();  // of the gland's box
  std::vector<Anatomy::Spot> calcifications_;
  std::optional<Volume> image_db_;
};

/// Material points, mm, W.
struct EchoPlaces {
  static constexpr std::size_t kMost = 64;
  std::size_t count = 0;
  alignas(64) float x[kMost], y[kMost], z[kMost];
};

struct EchoTissues {
  static constexpr std::size_t kMost = EchoPlaces::kMost;
  alignas(64) float distance_mm[EchoMap::kBoundaries][kMost];  ///< signed, negative inside
  alignas(64) float outside_db[kMost];                         ///< of what is around the gland, here
  alignas(64) float texture_db[kMost];                         ///< of the gland's coarse texture
  alignas(64) float loss_share[kMost];                         ///< attenuation, as a share of soft tissue's
};

}  // namespace brachy
