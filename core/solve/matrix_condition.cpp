#include "core/solve/matrix_condition.h"

#include "core/solve/norm_estimate.h"

namespace brachy {

double symmetric_norm(const Eigen::Ref<const Eigen::MatrixXd>& K, Eigen::Ref<Eigen::VectorXd> sums) noexcept {
  const Eigen::Index n = K.cols();
  sums.setZero();
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto below = K.col(j).tail(n - j - 1).cwiseAbs();
    sums[j] += std::abs(K(j, j)) + below.sum();
    sums.tail(n - j - 1) += below;
  }
  return n == 0 ? 0 : sums.maxCoeff();
}

double inverse_norm(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Ref<Eigen::MatrixXd> x) noexcept {
  const auto lower = L.triangularView<Eigen::Lower>();
  double* const columns[] = {x.col(0).data(), x.col(1).data(), x.col(2).data()};
  return estimate_inverse_norm(
      static_cast<std::size_t>(L.cols()), columns,
      [&](std::size_t i) {
        const auto at = static_cast<Eigen::Index>(i);
        return 1 / L(at, at);
      },
      [&] {
        for (Eigen::Index c = 0; c < 3;
             ++c) {  // one by one: several at a time allocate (core/DESIGN.md, section 7)
          auto column = x.col(c);
          lower.solveInPlace(column);
          lower.transpose().solveInPlace(column);
        }
      });
}

}  // namespace brachy
