#pragma once

#include <cstdint>
#include <optional>

#include "core/base/rigid_transform.h"
#include "haptics/devices/pose_fault.h"

namespace brachy {

/// Where the tissue is, as far as a pose is judged by it: a ball about it. Radius 0: not known.
struct TissueBall {
  Vec3 middle = Vec3::Zero();  ///< mm, frame W
  double radius_mm = 0;
};

/// Finds poses in metres and with quaternions in another order (x, y, z, w for w, x, y, z), which are rigid and in
/// range like any other, by what came before them from the same device. A mistake that begins between two poses gives
/// itself away, because the pose before, wrongly sent, is the new one: then it is refused. One that is there from the
/// first pose on is only likely, so that it is named and accepted.
///
/// In metres is a pose whose tip, times 1000, lies within 10 mm and a quarter of its distance from the origin of where
/// the tip was, at 4 mm from the origin or more. From the first pose on: the tip, of 20 poses or more, has moved by
/// 0.05 mm and never been 0.5 mm from the origin.
///
/// In another order is an orientation that is turned by 60° or more from the one before, with the tip within 20 mm of
/// where it was, and that with its quaternion cycled by one is within 15° of it. Where the shaft is not tilted by more
/// than 30°, so that the needle is but turned about it by half a turn, it is named and accepted: a bevel may be
/// flipped. From the first pose on: the needle comes to the tissue for the first time with its hub first, more than
/// 120° off its way from where it was farthest from it, 20 mm or more, without a jump of 10 mm. One that has been in
/// the tissue may come back from anywhere: also from behind, through which it was pushed.
///
/// Threads: one. Real-time: O(1), no allocation.
class PosePlausibility {
 public:
  explicit PosePlausibility(const TissueBall& tissue = {}) : tissue_(tissue) {}

  struct Verdict {
    std::optional<PoseFault> fault;
    bool is_refused = false;
  };
  /// Of a finite rigid pose that is in time.
  Verdict judge(const RigidTransform& X_WN);
  /// Another device.
  void reset();

 private:
  std::optional<PoseFault> doubt_since_start(const RigidTransform& X_WN);
  bool is_inside(const Vec3& p) const;
  bool is_hub_first(const RigidTransform& X_WN, double moved_mm);

  TissueBall tissue_;
  std::optional<RigidTransform> believed_;  ///< where the needle was, in mm and with the quaternion in order
  // Since the first pose:
  std::uint64_t poses_ = 0;
  Vec3 least_ = Vec3::Zero(), most_ = Vec3::Zero();  ///< of the tip, by coordinate
  double farthest_mm_ = 0;                           ///< of the tip from the origin
  // Of the way to the tissue:
  Vec3 way_from_ = Vec3::Zero();  ///< where the tip was farthest from it since the start or a jump
  bool has_been_inside_ = false;
};

}  // namespace brachy
