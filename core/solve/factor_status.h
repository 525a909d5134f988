#pragma once

namespace brachy {

/// How factoring a landmark system ended.
struct FactorStatus {
  /// Landmarks closer than this share of the length that their kernel varies over (support, core or needle
  /// radius) are duplicates, reported as a pair (core/DESIGN.md, section 4).
  static constexpr double kDuplicateDistance = 1e-6;

  /// Largest condition number (1-norm) that is solved. Cholesky and LU factorization leave a relative error of about
  /// 1e-16 · condition in the displacements (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed.,
  /// theorems 10.4 and 9.4): 1e-4 here, 0.001 mm of a landmark displaced by 10 mm. Scenes stay far below: 5e9 for
  /// ψ3,2 with 1000 landmarks a 64th of the support apart (core/DESIGN.md, section 4).
  static constexpr double kMaxCondition = 1e12;

  enum Kind {
    kOk,
    kNotFinite,            ///< landmark `first` has a coordinate that is not finite
    kDuplicate,            ///< landmarks `first` and `second` coincide
    kNotPositiveDefinite,  ///< rounding exceeds the least eigenvalue: landmarks too close for this kernel
    kIllConditioned,  ///< `condition` is above kMaxCondition: a solution would not reproduce the displacements
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
