#pragma once

#include <cstdint>

#include "core/base/rigid_transform.h"

namespace brachy {

/// What one needle has done to one organ until now. A pass begins when some part of the needle comes into it, and ends
/// when none is in it any more and the tip has been drawn back by more than kDrawnBackMm behind where it came in: a
/// needle that lies at the surface, or comes in again through a bend of the organ, makes one pass.
struct OrganContact {
  static constexpr double kDrawnBackMm = 1;

  bool is_in = false;              ///< a pass is under way
  std::uint32_t passes = 0;        ///< since the start
  std::uint64_t entered_tick = 0;  ///< of the last pass
  std::uint64_t left_tick = 0;     ///< of the last pass that has ended
  Vec3 entered_at = Vec3::Zero();  ///< the tip when the last pass began, mm, world frame W
  Vec3 axis = Vec3::UnitZ();       ///< the needle's then
  double depth_mm = 0;  ///< of the last pass: the largest distance from the organ's surface, inside
  double time_s = 0;    ///< of the last pass: with some part of the needle inside
};

}  // namespace brachy
