#include "apps/score/explanation/robust.h"

namespace brachy {
namespace {

constexpr double kOfNormal = 0.3853;  // P(|z| < 0.3853) = kCoreShare

}  // namespace

double inner_spread(std::vector<double> values) {
  if (values.size() < kFewestForSpread) return 0;
  std::ranges::sort(values);
  const auto n = static_cast<double>(values.size());
  const auto held = std::max<std::size_t>(3, static_cast<std::size_t>(std::ceil(kCoreShare * n)));
  double shortest = values.back() - values.front();
  for (std::size_t i = 0; i + held <= values.size(); ++i)
    shortest = std::min(shortest, values[i + held - 1] - values[i]);
  // The interval of `held` values spans held − 1 gaps; and the shortest of several is shorter than the middle one: 1 +
  // 12/n is by simulation, within 15 % from 12 to 150 values.
  const double of_gaps = static_cast<double>(held) / static_cast<double>(held - 1);
  return shortest * of_gaps / (2 * kOfNormal) * (1 + 12 / n);
}

}  // namespace brachy
