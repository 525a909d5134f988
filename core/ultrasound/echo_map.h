#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/brachytherapy/structures/structure.h"
#include "core/geometry/volume/volume.h"
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
  /// Boundaries, by their index in Tissue::distance_mm. A later one lies over an earlier one.
  enum Boundary : std::size_t { kGland, kTransition, kUrethra, kBladder, kBone, kBoundaries };

  struct Tissue {
    std::array<float, kBoundaries> distance_mm;  ///< signed, negative inside
    float outside_db = 0;                        ///< of what is around the gland, here
    float texture_db = 0;                        ///< of the gland's coarse texture
    float loss_share() const noexcept;           ///< attenuation, as a share of soft tissue's
  };
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

  Tissue at(const Vec3& X) const noexcept;
  /// The same at each of several places, faster: tissue[i] at X[i].
  void at(std::span<const Vec3> X, const ScanLoops& loops, std::span<Tissue> tissue) const noexcept;
  bool is_uniform() const { return grids_[kGland].is_empty() && !image_db_; }

 private:
  static constexpr std::size_t kGrains = 7;   // smooth noises that textures are made of
  using Grains = std::array<float, kGrains>;  // −1 … 1 each
  Tissue at(const Vec3& X, const Grains& grain) const noexcept;
  float bladder_distance(const Vec3& X) const noexcept;
  float bone_distance(const Vec3& X) const noexcept;

  std::array<DistanceGrid, kBoundaries>
      grids_;  // bladder: where the scene has one; transition and bone: never
  bool has_surroundings_ = false;
  std::uint32_t seed_ = 0;
  Vec3 middle_ = Vec3::Zero(), half_ = Vec3::Ones();  // of the gland's box
  struct Calcification {
    Vec3 at;
    float radius;
  };
  std::vector<Calcification> calcifications_;
  std::optional<Volume> image_db_;
};

}  // namespace brachy
