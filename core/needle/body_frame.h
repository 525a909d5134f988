#pragma once

#include "core/base/rigid_transform.h"

namespace brachy {

/// Where the body that the tissue is has gone as a whole, and how far it has swollen: x ↦ A x + b, from its frame B,
/// in which the tissue rests and deforms, to the world W. Injective where det A > 0.
/// Real-time: a plain value.
class BodyFrame {
 public:
  BodyFrame() = default;
  /// det A > 0.
  BodyFrame(const Mat3& A, const Vec3& b);

  bool is_identity() const { return is_identity_; }
  Vec3 to_world(const Vec3& p_B) const { return is_identity_ ? p_B : Vec3(A_ * p_B + b_); }
  Vec3 from_world(const Vec3& p_W) const { return is_identity_ ? p_W : Vec3(inverse_ * (p_W - b_)); }
  /// A needle's pose: its tip and axis go as points do; its cross-section stays round.
  RigidTransform from_world(const RigidTransform& X_WN) const;

  bool operator==(const BodyFrame& other) const { return A_ == other.A_ && b_ == other.b_; }

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(is_identity_, A_, inverse_, b_);
  }

 private:
  bool is_identity_ = true;
  Mat3 A_ = Mat3::Identity(), inverse_ = Mat3::Identity();
  Vec3 b_ = Vec3::Zero();
};

}  // namespace brachy
