#include "core/needle/followed_course.h"

#include <algorithm>

namespace brachy {

FollowedCourse::FollowedCourse(std::span<const Vec3> course) : points_(course.begin(), course.end()) {
  double arc = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (i > 0) arc += (points_[i] - points_[i - 1]).norm();
    arcs_.push_back(arc);
  }
}

void FollowedCourse::begin(const RigidTransform& X_WN, const RigidTransform& X_BN) noexcept {
  if (points_.size() < 2) return;
  find_tip(X_WN.p);
  is_followed_ = distance_ <= kReachMm;
  course_tip_ = on_course(at_);
  tip_ = X_BN.p;
  axis_ = X_BN.R.col(2);
  const Mat3 in_world = Eigen::Quaterniond::FromTwoVectors(direction(at_), X_WN.R.col(2)).toRotationMatrix();
  turn_ = X_BN.R * X_WN.R.transpose() * in_world;
}

// The place of the course that is nearest to the tip.
void FollowedCourse::find_tip(const Vec3& tip) noexcept {
  at_ = 0;
  distance_ = (tip - points_.front()).norm();
  for (std::size_t i = 1; i < points_.size(); ++i) {
    const Vec3 piece = points_[i] - points_[i - 1];
    const double length = arcs_[i] - arcs_[i - 1];
    const double t = std::clamp((tip - points_[i - 1]).dot(piece) / (length * length), 0.0, 1.0);
    const double distance = (tip - points_[i - 1] - t * piece).norm();
    if (distance >= distance_) continue;
    distance_ = distance;
    at_ = arcs_[i - 1] + t * length;
  }
}

// Piece i is between points i and i + 1.
std::size_t FollowedCourse::piece_of(double offset_mm) const noexcept {
  const auto next = std::ranges::upper_bound(arcs_, offset_mm);
  const auto i = static_cast<std::size_t>(next - arcs_.begin());
  return std::clamp<std::size_t>(i, 1, points_.size() - 1) - 1;
}

Vec3 FollowedCourse::on_course(double offset_mm) const noexcept {
  const std::size_t i = piece_of(offset_mm);
  const double t = (offset_mm - arcs_[i]) / (arcs_[i + 1] - arcs_[i]);
  return points_[i] + t * (points_[i + 1] - points_[i]);
}

Vec3 FollowedCourse::direction(double offset_mm) const noexcept {
  return (on_course(offset_mm - kHalfPieceMm) - on_course(offset_mm + kHalfPieceMm)).normalized();
}

// From piece to piece towards p, in one direction, so that a kink does not hold it between two of them.
FollowedCourse::Place FollowedCourse::nearest(const Vec3& p) const noexcept {
  const Vec3 wanted = course_tip_ + turn_.transpose() * (p - tip_);
  const std::size_t last = points_.size() - 2;
  std::size_t i = piece_of(at_ + (tip_ - p).dot(axis_));
  const auto share_of = [&](std::size_t piece) {
    const Vec3 way = points_[piece + 1] - points_[piece];
    return (wanted - points_[piece]).dot(way) / way.squaredNorm();
  };
  double t = share_of(i);
  if (t > 1) {
    while (t > 1 && i < last) t = share_of(++i);
    if (t < 0) t = 0;
  } else if (t < 0) {
    while (t < 0 && i > 0) t = share_of(--i);
    if (t > 1) t = 1;
  }
  const double offset = arcs_[i] + t * (arcs_[i + 1] - arcs_[i]);
  const Vec3 at = point(offset - at_), axis = turn_ * direction(offset);
  return {at - (at - p).dot(axis) * axis, axis};
}

}  // namespace brachy
