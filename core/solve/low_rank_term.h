#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/base/rigid_transform.h"
#include "core/solve/inverse_loops.h"

namespace brachy {

/// What few columns add to a matrix whose factor stays: solves with K + U Uᵀ by K = L Lᵀ (M. A. Woodbury, 1950;
/// Golub & Van Loan, Matrix Computations, 4th ed., section 2.1.4). With W = L⁻¹U and I + WᵀW = R Rᵀ,
///   (K + U Uᵀ)⁻¹ = L⁻ᵀ (I − Y Yᵀ) L⁻¹,   Y = W R⁻ᵀ.
/// Threads: one. Real-time: no allocation after construction.
class LowRankTerm {
 public:
  /// Of K for at most `max_landmarks`, three rows each; X of subtract_gram has as many columns at most.
  LowRankTerm(std::size_t max_landmarks, std::size_t max_columns, SimdTarget target);

  bool takes(std::size_t columns) const { return columns <= stride_; }
  void clear() noexcept { columns_ = 0; }
  bool is_empty() const { return columns_ == 0; }

  /// U = 0 with so many columns, which it must take; add fills it, three rows a landmark.
  void begin(std::size_t landmarks, std::size_t columns) noexcept;
  void add(std::size_t landmark, std::size_t column, const Vec3& value) noexcept;
  /// To be called whenever U or L is another.
  void factor(const PanelMatrix& L) noexcept;

  /// y −= Y Yᵀ y, y of as many rows as K has.
  void apply(double* y) noexcept;
  /// H −= Z Zᵀ, Z = XᵀY, in the lower triangle of columns × columns; X = L⁻¹A by rows, whose columns start at `starts`.
  void subtract_gram(const double* X, std::size_t stride, const std::uint32_t* starts, std::size_t columns,
                     Eigen::Ref<Eigen::MatrixXd> H) noexcept;
  /// The same of its diagonal alone.
  void subtract_squares(const double* X, std::size_t stride, const std::uint32_t* starts, std::size_t columns,
                        std::span<double> squares) noexcept;

 private:
  void project(const double* X, std::size_t stride, const std::uint32_t* starts,
               std::size_t columns) noexcept;

  const InverseLoops& loops_;
  std::size_t stride_;            // of W_
  std::size_t projected_stride_;  // of Z_
  std::size_t rows_ = 0, columns_ = 0;
  std::vector<double> W_;  // rows_ × columns_
  std::vector<double> Z_;  // WᵀX, then YᵀX: columns_ × those of X
  std::vector<std::uint32_t> starts_;
  std::vector<std::uint32_t> zeros_;
  Eigen::MatrixXd R_, gram_;
  Eigen::VectorXd sums_;
};

}  // namespace brachy
