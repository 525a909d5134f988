#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/models/scalar_kernel/scalar_kernel_field.h"
#include "core/simulation/simulator.h"

namespace brachy::bench {

constexpr std::size_t kPaperPoints = 14'560;  ///< of the paper's prostate

/// The default scene's phantom with that many points; made once and kept.
const Tissue& phantom(std::size_t points);

/// Landmarks tick by tick, in a cycle: up to four at the needle, pushed 5 mm in and a little differently each tick; the
/// others anchors spread evenly half way to the gland's centre, as in the paper. Moving ones circle 0.25 mm about
/// their position independently, all of them at every tick.
class LandmarkCycle {
 public:
  LandmarkCycle(std::size_t n, bool moving);

  void advance() { tick_ = (tick_ + 1) % kTicks; }
  std::span<const Vec3> positions() const { return positions_[tick_]; }          ///< n, mm
  std::span<const Vec3> displacements() const { return displacements_[tick_]; }  ///< n, mm

 private:
  static constexpr std::size_t kTicks = 16;
  std::size_t tick_ = 0;
  std::vector<Vec3> positions_[kTicks], displacements_[kTicks];
};

/// A tick with needles along +z, 8 mm apart, all tips at `z` (mm); of three, the middle one is at x 0.
void step_needles(Simulator& simulator, std::span<NeedlePose> poses, double z, MeshState& state);

/// What a set of landmarks reaches.
struct Reach {
  std::uint64_t pairs = 0;   ///< points × landmarks, inside the support
  std::uint64_t points = 0;  ///< inside at least one support
};
Reach count_reach(std::span<const Vec3> points, std::span<const Vec3> landmarks, double support_radius);

/// Largest difference between the engine's displacements and `u` at all points, mm: points of blocks out of reach are
/// at rest.
double largest_difference_mm(const Tissue& tissue, const BlockField& field, std::span<const Vec3> u);

}  // namespace brachy::bench
