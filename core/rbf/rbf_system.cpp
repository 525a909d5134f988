#include "core/rbf/rbf_system.h"

#include <cassert>
#include <Eigen/Cholesky>

namespace brachy {

RbfSystem::RbfSystem(Kernel kernel, double support_radius, int capacity)
    : kernel_(kernel), support_radius_(support_radius), K_(capacity, capacity), rhs_(capacity, 3) {
  assert(support_radius > 0 && capacity > 0);
}

FactorStatus RbfSystem::factorize(std::span<const Vec3> positions) noexcept {
  n_ = static_cast<int>(positions.size());
  assert(n_ <= K_.rows());
  for (int i = 0; i < n_; ++i)
    if (!positions[i].allFinite()) return {FactorStatus::kNotFinite, i, -1};

  FactorStatus status;
  std::visit(
      [&](auto kernel) {
        for (int j = 0; j < n_; ++j) {
          K_(j, j) = 1;  // ψ(0)
          for (int i = j + 1; i < n_; ++i) {
            const double r = (positions[i] - positions[j]).norm() / support_radius_;
            if (r < kDuplicateDistance && status) status = {FactorStatus::kDuplicate, j, i};
            K_(i, j) = kernel.value(r);
          }
        }
      },
      kernel_);
  if (!status) return status;

  auto K = K_.topLeftCorner(n_, n_);
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(K);  // in place, lower triangle
  if (llt.info() != Eigen::Success) return {FactorStatus::kNotPositiveDefinite, -1, -1};
  return status;
}

void RbfSystem::solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept {
  assert(static_cast<int>(displacements.size()) == n_ && static_cast<int>(weights.size()) == n_);
  for (int i = 0; i < n_; ++i) rhs_.row(i) = displacements[i].transpose();
  const auto L = K_.topLeftCorner(n_, n_).triangularView<Eigen::Lower>();
  auto x = rhs_.topRows(n_);
  L.solveInPlace(x);
  L.transpose().solveInPlace(x);
  for (int i = 0; i < n_; ++i) weights[i] = x.row(i).transpose();
}

}  // namespace brachy
