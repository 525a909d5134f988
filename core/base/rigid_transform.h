#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace brachy {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// Rigid transform X_AB: a point's coordinates in B to its coordinates in A, p_A = R p_B + p. Lengths in mm.
/// Monogram notation as in Drake's RigidTransform; the needle's pose in the world is X_WN.
struct RigidTransform {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();

  Vec3 operator*(const Vec3& point) const;
  RigidTransform operator*(const RigidTransform& other) const;
  RigidTransform inverse() const;
  bool operator==(const RigidTransform& other) const;
};

/// max |RᵀR − I| entrywise, or +inf where R is left-handed or any entry is not finite. 0 for a perfect rotation.
double rigidity_error(const RigidTransform& X);

/// Between a (s = 0) and b (s = 1): position linear, rotation by slerp. The ends are returned exactly.
RigidTransform interpolate(const RigidTransform& a, const RigidTransform& b, double s);

}  // namespace brachy
