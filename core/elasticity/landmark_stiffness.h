#pragma once

#include <numbers>

namespace brachy {

/// The force that moves a lone landmark of core radius ε mm by 1 mm in an unbounded elastic solid, N/mm: 4π μ
/// ε / (3/2 − b), b = 1/(4(1 − ν)). Kelvin's solution (core/elasticity/kelvin.h) at the landmark itself, x =
/// 0 and s = ε²/2 + ε²/2, is 1/(4πμ) [(1 − b)/ε + ε²/(2ε³)] = (3/2 − b)/(4π μ ε) mm/N. `shear_modulus` μ in N/mm².
constexpr double elastic_landmark_stiffness(double shear_modulus, double poisson, double core_radius) {
  const double b = 1 / (4 * (1 - poisson));
  return 4 * std::numbers::pi * shear_modulus * core_radius / (1.5 - b);
}

}  // namespace brachy
