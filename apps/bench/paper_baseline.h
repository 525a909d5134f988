#pragma once

#include <Eigen/Cholesky>
#include <span>
#include <vector>

#include "core/kernels/kernels.h"
#include "core/math/rigid_transform.h"

namespace brachy::bench {

/// The paper's way, straight from its section 2: dense K and Cholesky anew each time, then one loop over all points
/// and all landmarks in double. What everything else is compared with, in the same run.
class PaperBaseline {
 public:
  PaperBaseline(Kernel kernel, double support_radius) : kernel_(kernel), support_radius_(support_radius) {}

  void solve(std::span<const Vec3> positions, std::span<const Vec3> displacements);
  /// u at each of `points`.
  void evaluate(std::span<const Vec3> points, std::span<Vec3> u) const;

 private:
  Kernel kernel_;
  double support_radius_;
  std::vector<Vec3> positions_;
  Eigen::Matrix<double, Eigen::Dynamic, 3> weights_;
};

}  // namespace brachy::bench
