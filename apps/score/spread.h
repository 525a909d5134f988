#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace brachy {

/// Not known, or not defined.
inline constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

/// Mean, standard deviation (of the sample, n − 1) and largest of some numbers; kNoNumber where there are too few.
struct Spread {
  std::size_t count = 0;
  double mean = kNoNumber, sd = kNoNumber, max = kNoNumber;
};

inline Spread spread_of(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (double value : values) sum += value;
  Spread spread{.count = values.size()};
  if (values.empty()) return spread;
  spread.mean = sum / n;
  spread.max = *std::ranges::max_element(values);
  for (double value : values) squares += (value - spread.mean) * (value - spread.mean);
  if (values.size() > 1) spread.sd = std::sqrt(squares / (n - 1));
  return spread;
}

}  // namespace brachy
