#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "core/elasticity/landmark_compliance.h"

namespace brachy {

/// What bending needles add to the landmarks' compliance, as a product of few columns, C = U Uᵀ: Cholesky's method on
/// C(s, t) with supports along the needle as pivots. It leaves out what a needle that is held at its supports still
/// gives between them: at most 0.005 mm/N of 18 G (EI 15,720 N·mm²), where the tissue's own give is some tenths.
/// Threads: a plain value. Real-time: no allocation after construction, with at most `max_landmarks`.
class BeamColumns {
 public:
  static constexpr double kSupportMm = 20;          ///< between supports, three quarters of that at the ends
  static constexpr std::size_t kMostSupports = 24;  ///< of a needle; a longer one has them farther apart

  explicit BeamColumns(std::size_t max_landmarks);

  void find(const LandmarkCompliance& compliance) noexcept;

  std::size_t count() const { return count_; }
  /// ‖U Uᵀ‖₁ or a little more, mm/N.
  double norm() const { return norm_; }
  /// √scale U: `add(landmark, column, value)` for all that is not zero. Each needle has columns of its own.
  template <class Add>
  void each(double scale, const Add& add) const {
    const double root = std::sqrt(scale);
    for (const Row& row : rows_)
      for (std::size_t k = 0; k < row.supports; ++k)
        for (std::size_t side = 0; side < 2; ++side)
          add(row.landmark, row.column + 2 * k + side,
              Vec3(root * values_[row.values + k] * sides_[row.sides + side]));
  }

 private:
  void add_beam(const LandmarkCompliance& compliance, std::size_t beam) noexcept;

  struct Row {  // of one landmark
    std::size_t landmark, column, supports, values, sides;
  };
  std::size_t count_ = 0;
  double norm_ = 0;
  std::vector<Row> rows_;
  std::vector<double> values_;  // one for each support
  std::vector<Vec3> sides_;     // unit, across the needles, two of each
};

}  // namespace brachy
