#pragma once

#include <Eigen/Core>

namespace brachy {

/// ‖K‖₁ of the symmetric n × n matrix whose lower triangle is K's. `sums`: n, overwritten.
/// Real-time: does not allocate.
double symmetric_norm(const Eigen::Ref<const Eigen::MatrixXd>& K, Eigen::Ref<Eigen::VectorXd> sums) noexcept;

/// A lower bound of ‖K⁻¹‖₁, seldom under half of it, of K = L Lᵀ, L the lower triangle given (n × n): norm_estimate.h.
/// `x`: n × 3, overwritten.
/// Real-time: does not allocate.
double inverse_norm(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Ref<Eigen::MatrixXd> x) noexcept;

}  // namespace brachy
