#pragma once

#include <cstddef>
#include <vector>

#include "core/elasticity/fem/band_loops.h"

namespace brachy {

/// A symmetric, positive definite matrix with entries near its diagonal only: filled, then factored, then solved with
/// many right-hand sides at once. With the loops of LandmarkFactor, so that Cholesky's method works in panels of 16
/// rows.
/// Threads: solve may be called from any once it is factored. Memory: n × (half_band + 32) doubles.
class BandFactor {
 public:
  /// n × n zeros; entries may be filled up to `half_band` off the diagonal.
  BandFactor(int n, int half_band, SimdTarget target);

  /// An entry of the lower triangle, row ≥ column ≥ row − half_band.
  double& at(int row, int column) {
    return matrix().panel(row / PanelMatrix::kRows)[column].row[row % PanelMatrix::kRows];
  }

  /// False: not positive definite; it is of no use then.
  bool factor();

  /// x = A⁻¹ x for `sets` sets of right-hand sides, rows from `from` on, given that they are zero before row
  /// `zero_before`. Each set has padded_rows() rows, one after the other; those before `from` are left undefined.
  void solve(BandRow* x, std::size_t sets = 1, int zero_before = 0, int from = 0) const;

  int rows() const { return n_; }
  std::size_t padded_rows() const { return inverse_diagonal_.size(); }
  std::size_t bytes() const { return columns_.size() * sizeof(PanelColumn); }

 private:
  BandMatrix matrix() const {
    return {{const_cast<PanelColumn*>(columns_.data()), first_column_.data(),
             const_cast<double*>(inverse_diagonal_.data())},
            band_};
  }

  int n_, band_;
  SimdTarget target_;
  std::vector<PanelColumn> columns_;
  std::vector<int> first_column_;  // of each panel
  std::vector<double> inverse_diagonal_;
};

}  // namespace brachy
