#pragma once

#include <optional>
#include <span>

namespace brachy {

/// A figure that comes nearer to a plateau by the same share with every session: plateau + gain exp(−n / sessions),
/// n = 0, 1, …. Source of the form: Heathcote, Brown, Mewhort, Psychon. Bull. Rev. 7 (2000), 185–207, who find single
/// learners' curves exponential.
struct LearningCurve {
  double plateau = 0, gain = 0;
  double sessions = 0;  ///< after as many sessions 37 % of the gain is left
  double r_squared = 0;

  double at(double n) const;
};

/// The curve of a figure over sessions by least squares; values that are not finite are left out. None: fewer than
/// kLeastSessions are known; `sessions` is not between 0.5 and the number of values; or a constant or a straight line
/// explains them as well, by the corrected criterion of Akaike (Hurvich, Tsai, Biometrika 76, 1989, 297–307), which no
/// fewer values allow. Deterministic.
inline constexpr std::size_t kLeastSessions = 6;
std::optional<LearningCurve> learning_curve(std::span<const double> values);

/// The slope of a straight line by least squares over 0, 1, …; NaN where fewer than two values are known.
double slope_per_session(std::span<const double> values);

}  // namespace brachy
