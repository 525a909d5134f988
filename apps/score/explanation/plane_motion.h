#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "apps/score/explanation/robust.h"

namespace brachy {

/// A rigid motion of the template's plane, with or without its left and right exchanged: q = c + R M (p − c) + t, M
/// = diag(−1, 1) where mirrored. mm, x and y of W.
struct PlaneMotion {
  enum class Kind { kShift, kTurn, kMirror };
  Kind kind = Kind::kShift;
  double angle = 0;  ///< rad, of R, from x to y
  Vec2 shift = Vec2::Zero(), centre = Vec2::Zero();

  Vec2 moved(const Vec2& p) const;         ///< q − p
  Vec2 carried(const Vec2& v) const;       ///< a difference of two p: R M v
  Vec2 carried_back(const Vec2& v) const;  ///< its inverse
};

/// Planned places and how far from them their needles went.
struct PlaneShifts {
  std::vector<Vec2> at, off;  ///< of the same size
};

/// How well a motion explains the shifts: needles within kReachMm of it, and a truncated sum of squares (MSAC: Torr and
/// Zisserman, Comput. Vis. Image Underst. 78 (2000) 138–156) with what its parameters cost (BIC, 3 each).
struct MotionFit {
  static constexpr double kReachMm = 2;

  PlaneMotion motion;
  double cost = 0;
  std::vector<std::size_t> members;  ///< indices of PlaneShifts, rising
};

double cost_of_none(const PlaneShifts& shifts);
/// The best motion of a kind through one needle (kShift) or two (the others), refined with its members; nothing: there
/// are too few needles.
std::optional<MotionFit> best_motion(const PlaneShifts& shifts, PlaneMotion::Kind kind);

}  // namespace brachy
