#include "apps/lab/stability/sweeps.h"

namespace brachy {

std::span<const Sweep> all_sweeps() {
  static constexpr Sweep kSweeps[] = {
      {"push", sweep_push, 4.6},           {"plane", sweep_plane, 0.8},
      {"anchor", sweep_anchor, 2.1},       {"spacing", sweep_spacing, 5.8},
      {"precision", sweep_precision, 1.6}, {"support_ratio", sweep_support_ratio, 4.3},
      {"poisson", sweep_poisson, 3},       {"time_step", sweep_time_step, 0.1},
      {"lattice", sweep_lattice, 0.1},     {"coplanar", sweep_coplanar, 0.1}};
  return kSweeps;
}

}  // namespace brachy
