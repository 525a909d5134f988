#pragma once

#include <cmath>

namespace brachy {

/// The least eigenvalue of a ψ kernel's system (core/DESIGN.md, section 4): λmin ≈ c (q/a)^p for landmarks at least
/// q apart and support a. The power p follows from the decay of the kernel's Fourier transform (H. Wendland,
/// Scattered Data Approximation (2005), section 12.2); the constant c depends on how the landmarks lie, and is
/// measured (`brachy stability`).
struct EigenvalueLaw {
  int power;  ///< p

  // c of a 10³ grid with each coordinate jittered by ±0.2 of its spacing, where the least spacing q is well below
  // the usual one; of a 10³ grid; and of landmarks on a line.
  double on_jittered_grid, on_cubic_grid, on_shaft;

  double condition_of_1000;  ///< of 1000 landmarks on the jittered grid at a/q = 64, rounded

  /// λmin of landmarks so placed, whose c is `constant`.
  double least_eigenvalue(double constant, double a_over_q) const {
    return constant * std::pow(a_over_q, -power);
  }
};

}  // namespace brachy
