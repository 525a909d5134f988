#include "core/base/rigid_transform.h"

#include <limits>

namespace brachy {

Vec3 RigidTransform::operator*(const Vec3& point) const {
  return R * point + p;
}

RigidTransform RigidTransform::operator*(const RigidTransform& other) const {
  return {R * other.R, R * other.p + p};
}

RigidTransform RigidTransform::inverse() const {
  return {R.transpose(), -(R.transpose() * p)};
}

bool RigidTransform::operator==(const RigidTransform& other) const = default;

double rigidity_error(const RigidTransform& X) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!X.R.allFinite() || !X.p.allFinite() || X.R.determinant() <= 0) return kInfinity;
  return (X.R.transpose() * X.R - Mat3::Identity()).cwiseAbs().maxCoeff();
}

RigidTransform interpolate(const RigidTransform& a, const RigidTransform& b, double s) {
  if (s <= 0) return a;
  if (s >= 1) return b;
  const Eigen::Quaterniond q = Eigen::Quaterniond(a.R).slerp(s, Eigen::Quaterniond(b.R));
  return {q.normalized().toRotationMatrix(), (1 - s) * a.p + s * b.p};
}

}  // namespace brachy
