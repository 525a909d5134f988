#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>

namespace brachy {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// Rigid transform X_AB: a point's coordinates in B to its coordinates in A, p_A = R p_B + p. Lengths in mm.
/// Monogram notation as in Drake's RigidTransform; the needle's pose in the world is X_WN.
struct RigidTransform {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();

  Vec3 operator*(const Vec3& point) const { return R * point + p; }
  RigidTransform operator*(const RigidTransform& other) const { return {R * other.R, R * other.p + p}; }
  RigidTransform inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
  bool operator==(const RigidTransform&) const = default;
};

/// max |RᵀR − I| entrywise, or +inf where R is left-handed or any entry is not finite. 0 for a perfect rotation.
inline double rigidity_error(const RigidTransform& X) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!X.R.allFinite() || !X.p.allFinite() || X.R.determinant() <= 0) return kInfinity;
  return (X.R.transpose() * X.R - Mat3::Identity()).cwiseAbs().maxCoeff();
}

/// Between a (s = 0) and b (s = 1): position linear, rotation by slerp. The ends are returned exactly.
inline RigidTransform interpolate(const RigidTransform& a, const RigidTransform& b, double s) {
  if (s <= 0) return a;
  if (s >= 1) return b;
  const Eigen::Quaterniond q = Eigen::Quaterniond(a.R).slerp(s, Eigen::Quaterniond(b.R));
  return {q.normalized().toRotationMatrix(), (1 - s) * a.p + s * b.p};
}

}  // namespace brachy
