#pragma once

#include <algorithm>
#include <vector>

#include "core/elasticity/compact/compact_kernel.h"
#include "core/kernels/kernels.h"
#include "core/models/blended/membership.h"

namespace brachy {

// One kernel for each tissue, in the two kinds that BlendedKernelSystem is made for. kRows: unknowns that a
// landmark has to itself, 1 where the three components share one matrix. Threads: const functions from any.
// They do not allocate.

/// C_m(x) = ψ(|x|/a_m).
struct ScalarKernels {
  static constexpr int kRows = 1;
  using Value = double;

  Kernel psi;
  std::vector<double> supports;  ///< a_m, mm

  std::size_t size() const { return supports.size(); }
  double support(std::size_t m) const { return supports[m]; }
  double value(std::size_t m, const Vec3& x) const;
  /// ∇(C_m(x) f), 0 at the cusp of ψ3,0.
  Mat3 gradient(std::size_t m, const Vec3& x, const Vec3& f) const;
};

/// C_m of `compact_elastic`, mm/N: fitted to each tissue's support, with its modulus.
struct CompactKernels {
  static constexpr int kRows = 3;
  using Value = Mat3;

  std::vector<CompactKernel> kernels;

  std::size_t size() const { return kernels.size(); }
  double support(std::size_t m) const { return kernels[m].support(); }
  Mat3 value(std::size_t m, const Vec3& x) const { return kernels[m].value(x); }
  Mat3 gradient(std::size_t m, const Vec3& x, const Vec3& f) const { return kernels[m].gradient(x, f); }
};

/// K(x, y) = Σ_m w_m(x) w_m(y) C_m(x − y): as many kernels as the membership has tissues.
template <class Kernels>
struct TissueModel {
  Membership membership;
  Kernels kernels;

  double largest_support() const {
    double largest = 0;
    for (std::size_t m = 0; m < kernels.size(); ++m) largest = std::max(largest, kernels.support(m));
    return largest;
  }
};

}  // namespace brachy
