#pragma once

#include <cmath>

#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/simulator.h"

namespace brachy::test {

/// A needle pose with the tip at `tip` and the shaft's +z along `axis`.
inline RigidTransform pose_at(const Vec3& tip, const Vec3& axis) {
  const Vec3 z = axis.normalized();
  // Not Eigen's FromTwoVectors: its singular value decomposition takes seconds to compile in every test.
  const double s = std::sqrt(2 * (1 + z.z()));
  if (s < 1e-6) return {Vec3(1, -1, -1).asDiagonal().toDenseMatrix(), tip};
  const Eigen::Quaterniond q(0.5 * s, -z.y() / s, z.x() / s, 0);
  return {q.toRotationMatrix(), tip};
}

inline NeedlePose needle_pose(const RigidTransform& X_WN) {
  NeedlePose pose;
  pose.X_WN = X_WN;
  pose.present = true;
  return pose;
}

/// Tip positions from `from` to `to` in steps of at most `step` mm, both ends included.
inline std::vector<Vec3> straight(const Vec3& from, const Vec3& to, double step) {
  const int n = static_cast<int>(std::ceil((to - from).norm() / step));
  std::vector<Vec3> points;
  for (int i = 0; i <= n; ++i) points.push_back(from + (to - from) * (static_cast<double>(i) / n));
  return points;
}

/// A full insertion along +z beside the midline and back out, with a sideways push at the deepest point.
inline std::vector<RigidTransform> insertion() {
  std::vector<RigidTransform> poses;
  const auto go = [&](const Vec3& from, const Vec3& to, double step) {
    for (const Vec3& tip : straight(from, to, step)) poses.push_back(pose_at(tip, Vec3::UnitZ()));
  };
  go({8, -4, -40}, {8, -4, 14}, 0.2);
  go({8, -4, 14}, {9.5, -4.5, 14}, 0.05);
  go({9.5, -4.5, 14}, {8, -4, 14}, 0.05);
  go({8, -4, 14}, {8, -4, -40}, 0.3);
  return poses;
}

}  // namespace brachy::test
