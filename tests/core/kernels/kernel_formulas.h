#pragma once

#include <cmath>
#include <complex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/kernels/kernels.h"

namespace brachy::test {

using Real = long double;
using Complex = std::complex<Real>;

template <class R>
R power(R x, int n) {
  R product = 1;
  for (; n > 0; --n) product *= x;
  return product;
}

/// A kernel as core/DESIGN.md, section 2, gives it, independent of core; for 0 < r < 1.
struct KernelFormula {
  std::string_view name;
  /// Bound of the roundings of a value in single precision, each an error of at most 2⁻²⁵. (1−r)ᵐ q(r) of degree d by
  /// repeated squaring and Horner's rule has at most 2d: the one of 1 − r counts m times, m − 1 multiplications, two
  /// for each degree of q, and the product.
  int roundings;
  Real (*value)(Real r);
  Complex (*of_complex)(Complex r);
};

/// `psi`: a lambda that takes Real and Complex.
template <class Psi>
constexpr KernelFormula kernel_formula(std::string_view name, int roundings, Psi) {
  return {name, roundings, [](Real r) { return Psi{}(r); }, [](Complex r) { return Psi{}(r); }};
}

/// The formula of every kernel; a new kernel gets a line here.
inline const KernelFormula kKernelFormulas[] = {
    kernel_formula("psi30", 3, [](auto r) { return power(Real(1) - r, 2); }),
    kernel_formula("psi31", 9, [](auto r) { return power(Real(1) - r, 4) * (Real(4) * r + Real(1)); }),
    kernel_formula(
        "psi32", 15,
        [](auto r) { return power(Real(1) - r, 6) * (Real(35) / 3 * r * r + Real(6) * r + Real(1)); }),
    kernel_formula("buhmann", 15, [](auto r) {
      return power(r, 4) * (Real(12) * std::log(r) - Real(21)) + Real(32) * power(r, 3) - Real(12) * r * r +
             Real(1);
    })};

inline const KernelFormula& formula_of(std::string_view name) {
  for (const KernelFormula& formula : kKernelFormulas)
    if (formula.name == name) return formula;
  throw std::out_of_range("no formula of the kernel " + std::string(name) +
                          ": add it to tests/core/kernels/kernel_formulas.h");
}

/// ψ(r), r ≥ 0.
inline Real reference_psi(const KernelFormula& formula, Real r) {
  if (r >= 1) return 0;
  return r > 0 ? formula.value(r) : 1;
}

/// ψ′(r), r ≥ 0, at 0 from the right: Im ψ(r + ih)/h, which has no cancellation (complex-step differentiation).
inline Real reference_slope(const KernelFormula& formula, Real r) {
  constexpr Real kStep = 1e-30L;
  return r < 1 ? formula.of_complex({r, kStep}).imag() / kStep : 0;
}

/// Every kernel, for parameterized tests.
inline std::vector<Kernel> all_kernels() {
  std::vector<Kernel> kernels;
  for_each_kernel([&](auto kernel) { kernels.emplace_back(kernel); });
  return kernels;
}

}  // namespace brachy::test
