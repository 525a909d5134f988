#include "apps/score/explanation/plane_motion.h"

#include <array>

namespace brachy {
namespace {

constexpr double kSpreadMm = 0.7;  // of a needle's place, each way: template play (Scene::noise)
constexpr double kPerParameter = 3;
constexpr double kSnapAngle = 0.035, kSnapMm = 0.6;  // rad, mm: within what needles' play does to a fit
constexpr double kFarthestPairMm = 8;                // needles nearer together say little of a turn
constexpr std::size_t kMostPairs = 2000;

double penalty(double mm) {
  const double bounded = std::min(mm, MotionFit::kReachMm) / kSpreadMm;
  return bounded * bounded;
}

Vec2 turned(const Vec2& v, double angle) {
  return {std::cos(angle) * v.x() - std::sin(angle) * v.y(),
          std::sin(angle) * v.x() + std::cos(angle) * v.y()};
}

Vec2 mirrored(const Vec2& v) {
  return {-v.x(), v.y()};
}

/// Least squares over `members` (Kabsch in the plane).
PlaneMotion through(const PlaneShifts& shifts, std::span<const std::size_t> members, PlaneMotion::Kind kind) {
  PlaneMotion motion;
  motion.kind = kind;
  const auto n = static_cast<double>(members.size());
  Vec2 off = Vec2::Zero();
  for (const std::size_t i : members) {
    motion.centre += shifts.at[i] / n;
    off += shifts.off[i] / n;
  }
  motion.shift = off;
  if (kind == PlaneMotion::Kind::kShift) return motion;
  double across = 0, along = 0;
  for (const std::size_t i : members) {
    const Vec2 from = shifts.at[i] - motion.centre;
    const Vec2 p = kind == PlaneMotion::Kind::kMirror ? mirrored(from) : from, q = from + shifts.off[i] - off;
    across += p.x() * q.y() - p.y() * q.x();
    along += p.dot(q);
  }
  motion.angle = std::atan2(across, along);
  if (kind == PlaneMotion::Kind::kMirror && std::abs(motion.angle) < kSnapAngle) {
    // Mirrored about a line that is parallel to y and, as templates are, through a hole's middle or between two.
    motion.angle = 0;
    if (std::abs(motion.shift.y()) < kSnapMm) motion.shift.y() = 0;
  }
  return motion;
}

MotionFit judged(const PlaneShifts& shifts, const PlaneMotion& motion) {
  MotionFit fit{motion, kPerParameter * (motion.kind == PlaneMotion::Kind::kShift ? 2 : 3), {}};
  for (std::size_t i = 0; i < shifts.at.size(); ++i) {
    const double mm = (shifts.off[i] - motion.moved(shifts.at[i])).norm();
    fit.cost += penalty(mm);
    if (mm <= MotionFit::kReachMm) fit.members.push_back(i);
  }
  return fit;
}

}  // namespace

Vec2 PlaneMotion::carried(const Vec2& v) const {
  return turned(kind == Kind::kMirror ? mirrored(v) : v, angle);
}

Vec2 PlaneMotion::carried_back(const Vec2& v) const {
  const Vec2 back = turned(v, -angle);
  return kind == Kind::kMirror ? mirrored(back) : back;
}

Vec2 PlaneMotion::moved(const Vec2& p) const {
  return kind == Kind::kShift ? shift : Vec2(carried(p - centre) + shift - (p - centre));
}

double cost_of_none(const PlaneShifts& shifts) {
  double cost = 0;
  for (const Vec2& off : shifts.off) cost += penalty(off.norm());
  return cost;
}

std::optional<MotionFit> best_motion(const PlaneShifts& shifts, PlaneMotion::Kind kind) {
  const std::size_t n = shifts.at.size();
  std::optional<MotionFit> best;
  const auto try_with = [&](const auto& members) {
    MotionFit fit = judged(shifts, through(shifts, members, kind));
    for (int again = 0; again < 2 && fit.members.size() > members.size(); ++again)
      if (MotionFit finer = judged(shifts, through(shifts, fit.members, kind)); finer.cost < fit.cost)
        fit = std::move(finer);
    if (!best || fit.cost < best->cost) best = std::move(fit);
  };
  if (kind == PlaneMotion::Kind::kShift) {
    for (std::size_t i = 0; i < n; ++i) try_with(std::array{i});
    return best;
  }
  const std::size_t step = 1 + n * n / 2 / kMostPairs;
  for (std::size_t i = 0, pair = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j)
      if ((shifts.at[i] - shifts.at[j]).norm() >= kFarthestPairMm && pair++ % step == 0)
        try_with(std::array{i, j});
  return best;
}

}  // namespace brachy
