#include "apps/bench/paper_baseline.h"

namespace brachy::bench {

void PaperBaseline::solve(std::span<const Vec3> positions, std::span<const Vec3> displacements) {
  positions_.assign(positions.begin(), positions.end());
  const auto n = static_cast<Eigen::Index>(positions.size());
  Eigen::MatrixXd K(n, n);
  Eigen::Matrix<double, Eigen::Dynamic, 3> d(n, 3);
  std::visit(
      [&](auto kernel) {
        for (Eigen::Index i = 0; i < n; ++i) {
          d.row(i) = displacements[static_cast<std::size_t>(i)].transpose();
          for (Eigen::Index j = 0; j < n; ++j)
            K(i, j) = kernel.value(
                (positions_[static_cast<std::size_t>(i)] - positions_[static_cast<std::size_t>(j)]).norm() /
                support_radius_);
        }
      },
      kernel_);
  weights_ = K.llt().solve(d);
}

void PaperBaseline::evaluate(std::span<const Vec3> points, std::span<Vec3> u) const {
  std::visit(
      [&](auto kernel) {
        const auto count = static_cast<std::ptrdiff_t>(points.size());
#pragma omp parallel for schedule(static)
        for (std::ptrdiff_t q = 0; q < count; ++q) {
          Vec3 sum = Vec3::Zero();
          for (std::size_t i = 0; i < positions_.size(); ++i) {
            const double r = (points[static_cast<std::size_t>(q)] - positions_[i]).norm() / support_radius_;
            if (r < 1) sum += kernel.value(r) * weights_.row(static_cast<Eigen::Index>(i)).transpose();
          }
          u[static_cast<std::size_t>(q)] = sum;
        }
      },
      kernel_);
}

}  // namespace brachy::bench
