#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// A catheter that follows its planned course, straight between points from the tip backwards: behind the tip it lies
/// as the course does behind the place nearest to the tip, moved and turned, by the least rotation, so that tip and
/// direction are the pose's. A catheter whose tip goes along the course lies on it. Beyond the course's ends it is
/// straight. mm.
/// Threads: one. Real-time: no allocation after construction.
class FollowedCourse {
 public:
  /// Three holes of a template: a tip farther from its course does not follow it.
  static constexpr double kReachMm = 15;
  /// Half the piece of the course whose direction is a place's: without the kinks at its points.
  static constexpr double kHalfPieceMm = 2;

  /// A point of the course or the catheter, and the unit direction to the tip there.
  struct Place {
    Vec3 point = Vec3::Zero(), axis = Vec3::UnitZ();
  };

  /// `course`: at least two points, none twice in a row, world frame W; or none: nothing is followed.
  explicit FollowedCourse(std::span<const Vec3> course = {});

  /// Lays it behind the tip of X_WN; X_BN is the same pose in the frame in which the catheter is asked for. Both are
  /// one where the body is the world.
  void begin(const RigidTransform& X_WN, const RigidTransform& X_BN) noexcept;
  /// Whether there is a course and the tip is within kReachMm of it.
  bool is_followed() const { return is_followed_; }

  /// The catheter's point at arc length `behind_mm` from the tip, and its direction. B.
  Vec3 point(double behind_mm) const noexcept {
    return tip_ + turn_ * (on_course(at_ + behind_mm) - course_tip_);
  }
  /// The catheter's point nearest to p, as one comes to it downhill from where a straight needle has it, and its
  /// direction; the point is straight across from p, so beside a kink a little off the course. B.
  Place nearest(const Vec3& p) const noexcept;

  double length_mm() const { return arcs_.empty() ? 0 : arcs_.back(); }  ///< of the course
  double at_mm() const { return at_; }  ///< how far behind the course's first point the tip's place is
  double distance_mm() const { return distance_; }  ///< of the tip from there
  /// The point of the course `offset_mm` behind its first one, straight beyond its ends; and its direction.
  Vec3 on_course(double offset_mm) const noexcept;
  Vec3 direction(double offset_mm) const noexcept;

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(is_followed_, at_, distance_, course_tip_, tip_, axis_, turn_);
  }

 private:
  std::size_t piece_of(double offset_mm) const noexcept;
  void find_tip(const Vec3& tip) noexcept;

  std::vector<Vec3> points_;
  std::vector<double> arcs_;  // of each point, from the first
  bool is_followed_ = false;
  double at_ = 0, distance_ = 0;
  Vec3 course_tip_ = Vec3::Zero(), tip_ = Vec3::Zero(), axis_ = Vec3::UnitZ();
  Mat3 turn_ = Mat3::Identity();  // from the course's directions to the catheter's
};

}  // namespace brachy
