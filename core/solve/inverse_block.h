#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/base/rigid_transform.h"
#include "core/solve/inverse_loops.h"

namespace brachy {

/// A symmetric block AᵀK⁻¹A of the inverse of a matrix whose Cholesky factor L is known, without the inverse: XᵀX with
/// X = L⁻¹A. Columns of A start late (a landmark's rows are its own), and so do those of X: 2/3 of the work is saved.
/// Threads: one. Real-time: no allocation after construction.
class InverseBlock {
 public:
  /// For L of at most `max_rows` rows and A of at most `max_columns` columns.
  InverseBlock(std::size_t max_rows, std::size_t max_columns, SimdTarget target);

  /// H_ij = axes_i · (K⁻¹)_{ij} axes_j for landmarks first … first + m − 1 of three rows each, K = L Lᵀ and L the lower
  /// triangle given.
  void project(const Eigen::Ref<const Eigen::MatrixXd>& L, std::size_t first, std::span<const Vec3> axes,
               Eigen::Ref<Eigen::MatrixXd> H) noexcept;

  /// H_ij = (K⁻¹)_ij (axes_i · axes_j) for landmarks first … first + m − 1 of one row each.
  void scale(const Eigen::Ref<const Eigen::MatrixXd>& L, std::size_t first, std::span<const Vec3> axes,
             Eigen::Ref<Eigen::MatrixXd> H) noexcept;

  // For a factor that is stored differently: the caller fills X (`rows` × m), then H as in scale.
  void begin(std::size_t rows, std::size_t columns) noexcept;  ///< X = 0
  double* row(std::size_t i) { return X_.data() + i * stride_; }
  void set_start(std::size_t column, std::size_t row) { starts_[column] = static_cast<std::uint32_t>(row); }
  void finish_scaled(std::span<const Vec3> axes, Eigen::Ref<Eigen::MatrixXd> H) noexcept;

 private:
  void solve(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Index from) noexcept;
  void gram(Eigen::Ref<Eigen::MatrixXd> H) noexcept;

  const InverseLoops& loops_;
  std::size_t rows_ = 0, columns_ = 0, stride_ = 0;
  std::vector<double> X_;  // rows_ × stride_
  std::vector<std::uint32_t> starts_;
};

}  // namespace brachy
