#include "apps/stability/sweeps.h"

namespace brachy {

std::span<const Sweep> all_sweeps() {
  static constexpr Sweep kSweeps[] = {{"push", sweep_push},           {"plane", sweep_plane},
                                      {"anchor", sweep_anchor},       {"spacing", sweep_spacing},
                                      {"precision", sweep_precision}, {"support_ratio", sweep_support_ratio},
                                      {"poisson", sweep_poisson},     {"time_step", sweep_time_step},
                                      {"lattice", sweep_lattice},     {"coplanar", sweep_coplanar}};
  return kSweeps;
}

}  // namespace brachy
