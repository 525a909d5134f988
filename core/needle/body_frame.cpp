#include "core/needle/body_frame.h"

#include <Eigen/LU>

namespace brachy {

BodyFrame::BodyFrame(const Mat3& A, const Vec3& b)
    : is_identity_(A == Mat3::Identity() && b == Vec3::Zero()), A_(A), inverse_(A.inverse()), b_(b) {}

RigidTransform BodyFrame::from_world(const RigidTransform& X_WN) const {
  if (is_identity_) return X_WN;
  const Mat3 turned = inverse_ * X_WN.R;
  RigidTransform X_BN;
  X_BN.p = from_world(X_WN.p);
  const Vec3 z = turned.col(2).normalized();
  const Vec3 x = (turned.col(0) - turned.col(0).dot(z) * z).normalized();
  X_BN.R.col(0) = x;
  X_BN.R.col(1) = z.cross(x);
  X_BN.R.col(2) = z;
  return X_BN;
}

}  // namespace brachy
