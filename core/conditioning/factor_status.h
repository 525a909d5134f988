#pragma once

namespace brachy {

/// How factoring a landmark system ended.
struct FactorStatus {
  /// Landmarks closer than this share of the length that their kernel varies over (support, core or needle radius) are one
  /// place to the solver: duplicates, refused by name (DESIGN §4).
  static constexpr double kDuplicateDistance = 1e-6;

  /// Largest condition number (1-norm) that is solved. Cholesky's and Gauss's methods leave about 1e-16 · condition of the
  /// displacements unreproduced (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., theorems 10.4 and 9.4):
  /// 1e-4 here, 0.001 mm of a landmark displaced by 10 mm. What scenes have is far below: 5e9 for ψ3,2 with 1000 landmarks
  /// a 64th of the support apart (DESIGN §4).
  static constexpr double kMaxCondition = 1e12;

  enum Kind {
    kOk,
    kNotFinite,            ///< landmark `first` has a coordinate that is not finite
    kDuplicate,            ///< landmarks `first` and `second` are one place to the solver
    kNotPositiveDefinite,  ///< rounding has eaten the least eigenvalue: landmarks too close for this kernel
    kIllConditioned,       ///< `condition` is above kMaxCondition: a solution would not be the landmarks'
  } kind = kOk;
  int first = -1, second = -1;  ///< landmark indices, for kNotFinite and kDuplicate
  double condition = 0;         ///< estimated, 1-norm; for kIllConditioned

  explicit operator bool() const { return kind == kOk; }

  /// kOk, or kIllConditioned where `condition` is above the bound or no number.
  static FactorStatus of_condition(double condition) {
    if (condition <= kMaxCondition) return {};
    return {kIllConditioned, -1, -1, condition};
  }
};

}  // namespace brachy
