#include "haptics/devices/pose_plausibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace brachy {
namespace {

constexpr double kMmPerM = 1000;
constexpr double kLeastFromOriginMm = 4, kMostOffMm = 10, kMostOffShare = 0.25;
constexpr double kNearOriginMm = 0.5, kLeastMotionMm = 0.05;
constexpr std::uint64_t kLeastPoses = 20;
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kLeastTurn = 60 * kDegree, kMostOffTurn = 15 * kDegree, kMostTilt = 30 * kDegree;
constexpr double kMostStepMm = 20;           // of the tip, while its orientation is in doubt
constexpr double kJumpMm = 10, kWayMm = 20;  // of the way to the tissue, the least
constexpr double kHubFirst = -0.5;           // cos 120°

/// Of two unit vectors.
double angle(const Vec3& a, const Vec3& b) {
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0));
}

/// The rotations whose quaternion, read in another order, gives this one.
std::array<Eigen::Quaterniond, 2> read_in_another_order(const Eigen::Quaterniond& q) {
  // Eigen's constructor takes w, x, y, z.
  return {Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()), Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y())};
}

}  // namespace

void PosePlausibility::reset() {
  *this = PosePlausibility(tissue_);
}

PosePlausibility::Verdict PosePlausibility::judge(const RigidTransform& X_WN) {
  if (!believed_) {
    believed_ = X_WN;
    way_from_ = least_ = most_ = X_WN.p;
    has_been_inside_ = is_inside(X_WN.p);
    return {doubt_since_start(X_WN), false};
  }
  const double from_origin_mm = believed_->p.norm();
  if (from_origin_mm >= kLeastFromOriginMm &&
      (kMmPerM * X_WN.p - believed_->p).norm() <= std::min(kMostOffMm, kMostOffShare * from_origin_mm)) {
    believed_ = RigidTransform{X_WN.R, kMmPerM * X_WN.p};
    return {PoseFault::kMetres, true};
  }
  const Eigen::Quaterniond q(X_WN.R), before(believed_->R);
  if ((X_WN.p - believed_->p).norm() <= kMostStepMm && q.angularDistance(before) >= kLeastTurn) {
    for (const Eigen::Quaterniond& other : read_in_another_order(q)) {
      if (other.angularDistance(before) > kMostOffTurn) continue;
      if (angle(X_WN.R.col(2), believed_->R.col(2)) > kMostTilt) {
        believed_ = RigidTransform{other.toRotationMatrix(), X_WN.p};
        return {PoseFault::kQuaternionOrder, true};
      }
      believed_ = X_WN;
      return {PoseFault::kQuaternionOrder, false};
    }
  }
  const double moved_mm = (X_WN.p - believed_->p).norm();
  believed_ = X_WN;
  if (is_hub_first(X_WN, moved_mm)) return {PoseFault::kQuaternionOrder, false};
  return {doubt_since_start(X_WN), false};
}

std::optional<PoseFault> PosePlausibility::doubt_since_start(const RigidTransform& X_WN) {
  ++poses_;
  farthest_mm_ = std::max(farthest_mm_, X_WN.p.norm());
  least_ = least_.cwiseMin(X_WN.p);
  most_ = most_.cwiseMax(X_WN.p);
  const bool is_in_metres =
      poses_ >= kLeastPoses && farthest_mm_ < kNearOriginMm && (most_ - least_).norm() >= kLeastMotionMm;
  return is_in_metres ? std::optional(PoseFault::kMetres) : std::nullopt;
}

bool PosePlausibility::is_inside(const Vec3& p) const {
  return (p - tissue_.middle).norm() <= tissue_.radius_mm;
}

bool PosePlausibility::is_hub_first(const RigidTransform& X_WN, double moved_mm) {
  if (has_been_inside_ || tissue_.radius_mm <= 0) return false;
  const bool has_jumped = moved_mm > kJumpMm;
  has_been_inside_ = is_inside(X_WN.p);
  if (!has_been_inside_) {
    if (has_jumped || (X_WN.p - tissue_.middle).norm() >= (way_from_ - tissue_.middle).norm())
      way_from_ = X_WN.p;
    return false;
  }
  const Vec3 way = X_WN.p - way_from_;
  return !has_jumped && way.norm() >= kWayMm && way.normalized().dot(X_WN.R.col(2)) < kHubFirst;
}

}  // namespace brachy
