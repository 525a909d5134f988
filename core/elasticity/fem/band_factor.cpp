#include "core/elasticity/fem/band_factor.h"

#include <algorithm>
#include <cassert>

namespace brachy {
namespace {

constexpr int kRows = PanelMatrix::kRows, kStep = PanelMatrix::kColumnStep;

}  // namespace

// A panel's first row reaches half_band to the left, from where it begins at a multiple of kStep.
BandFactor::BandFactor(int n, int half_band, SimdTarget target)
    : n_(n), band_((half_band + kStep - 1) / kStep * kStep), target_(target) {
  assert(n > 0 && half_band > 0);
  const int panels = (n + kRows - 1) / kRows;
  columns_.resize(static_cast<std::size_t>(panels) * static_cast<std::size_t>(band_ + kRows));
  inverse_diagonal_.resize(static_cast<std::size_t>(panels) * kRows);
  for (int I = 0; I < panels; ++I) first_column_.push_back(std::max(0, I * kRows - band_));
}

bool BandFactor::factor() {
  return panel_loops(target_).factor_band(matrix(), 0, static_cast<int>(first_column_.size()), n_);
}

void BandFactor::solve(BandRow* x, std::size_t count, int zero_before, int from) const {
  const BandLoops& loops = band_loops(target_);
  const BandSets sets{x, count, padded_rows()};
  loops.forward(matrix(), n_, zero_before, sets);
  loops.backward(matrix(), n_, from, sets);
}

}  // namespace brachy
