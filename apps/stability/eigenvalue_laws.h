#pragma once

#include <cmath>
#include <string_view>

namespace brachy {

/// λmin ≈ c (q/a)^p of a ψ kernel's system (DESIGN §4): p is 1, 3, 5, 3 for ψ3,0, ψ3,1, ψ3,2 and Buhmann (by the decay of
/// their Fourier transforms: H. Wendland, Scattered Data Approximation (2005), section 12.2); c by how the landmarks lie.
struct EigenvalueLaw {
  /// DESIGN's first constants are those of a 10³ grid with each coordinate jittered by ±0.2 of its spacing, where the least
  /// spacing q is well below the usual one.
  enum Landmarks { kJitteredGrid, kCubicGrid, kShaft };
  double constant = 0;
  int power = 0;
  double condition_of_1000 =
      0;  ///< of 1000 landmarks on the jittered grid at a/q = 64, in DESIGN's round figures

  double least_eigenvalue(double a_over_q) const { return constant * std::pow(a_over_q, -power); }
};

inline EigenvalueLaw eigenvalue_law(std::string_view kernel, EigenvalueLaw::Landmarks landmarks) {
  struct Row {
    std::string_view kernel;
    int power;
    double constant[3];
    double condition_of_1000;
  };
  constexpr Row kRows[] = {{"psi30", 1, {1.17, 0.77, 1.0}, 4e4},
                           {"psi31", 3, {7.9, 2.1, 5.0}, 3e7},
                           {"psi32", 5, {161, 15.5, 77}, 5e9},
                           {"buhmann", 3, {12.5, 3.3, 8.0}, 2e7}};
  for (const Row& row : kRows)
    if (row.kernel == kernel) return {row.constant[landmarks], row.power, row.condition_of_1000};
  return {};
}

}  // namespace brachy
