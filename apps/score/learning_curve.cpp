#include "apps/score/learning_curve.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace brachy {
namespace {

/// y = constant + factor f(n) by least squares over the known values.
struct LineFit {
  std::size_t count = 0;
  double constant = 0, factor = 0;
  double squares_about_mean = 0, squares = 0;  // before and after
};

LineFit fitted(std::span<const double> values, const std::function<double(double n)>& f) {
  double n = 0, x = 0, y = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    n += 1;
    x += f(static_cast<double>(i));
    y += values[i];
  }
  LineFit fit{.count = static_cast<std::size_t>(n)};
  if (n == 0) return fit;
  x /= n;
  y /= n;
  double xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    const double dx = f(static_cast<double>(i)) - x, dy = values[i] - y;
    xx += dx * dx;
    xy += dx * dy;
    yy += dy * dy;
  }
  fit.factor = xx > 0 ? xy / xx : std::numeric_limits<double>::quiet_NaN();
  fit.constant = y - fit.factor * x;
  fit.squares_about_mean = yy;
  fit.squares = std::max(yy - fit.factor * xy, 0.0);
  return fit;
}

/// Akaike's corrected criterion of a fit with so many parameters, the variance among them.
double criterion(double squares, std::size_t count, int parameters) {
  const auto n = static_cast<double>(count);
  // What is left of an exact fit is rounding: a floor keeps exact fits comparable by their parameters.
  constexpr double kLeast = 1e-18;
  return n * std::log(std::max(squares / n, kLeast)) + 2.0 * parameters * n / (n - parameters - 1);
}

}  // namespace

double LearningCurve::at(double n) const {
  return plateau + gain * std::exp(-n / sessions);
}

double slope_per_session(std::span<const double> values) {
  return fitted(values, [](double n) { return n; }).factor;
}

std::optional<LearningCurve> learning_curve(std::span<const double> values) {
  const LineFit line = fitted(values, [](double n) { return n; });
  if (line.count < kLeastSessions) return std::nullopt;
  const double all = line.squares_about_mean;
  // Faster than half a session nothing but the first one is left of the gain; slower than all sessions it is a line.
  constexpr double kFastest = 0.5;
  const auto slowest = static_cast<double>(values.size());
  constexpr int kSteps = 100;
  LearningCurve best;
  double least = std::numeric_limits<double>::infinity();
  int best_step = 0;
  for (int step = 0; step <= kSteps; ++step) {
    const double sessions = kFastest * std::pow(slowest / kFastest, static_cast<double>(step) / kSteps);
    const LineFit fit = fitted(values, [&](double n) { return std::exp(-n / sessions); });
    if (!(fit.squares < least)) continue;
    least = fit.squares;
    best_step = step;
    best = {fit.constant, fit.factor, sessions, 1 - fit.squares / all};
  }
  // At the range's end the values do not say how fast they go.
  if (best_step == 0 || best_step == kSteps) return std::nullopt;
  const double of_curve = criterion(least, line.count, 4);
  if (!(of_curve < criterion(line.squares, line.count, 3)) || !(of_curve < criterion(all, line.count, 2)))
    return std::nullopt;
  return best;
}

}  // namespace brachy
