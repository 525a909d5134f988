#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "core/geometry/surface/plane_section.h"

namespace brachy {

/// The largest set of values that lie within `reach` of one of them, and their mean. Of sets as large, the one nearest
/// to zero. Value: double or Vec2, at least one.
template <class Value>
struct Cluster {
  Value mean;
  std::vector<std::size_t> members;  ///< indices, rising
};

inline double size_of(double v) {
  return std::abs(v);
}
inline double size_of(const Vec2& v) {
  return v.norm();
}

template <class Value>
Cluster<Value> largest_cluster(std::span<const Value> values, double reach) {
  const auto about = [&](const Value& centre) {
    Cluster<Value> c{centre, {}};
    Value sum = 0 * centre;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (size_of(Value(values[i] - centre)) <= reach) {
        c.members.push_back(i);
        sum += values[i];
      }
    if (!c.members.empty()) c.mean = sum / static_cast<double>(c.members.size());
    return c;
  };
  Cluster<Value> best{0 * values[0], {}};
  for (const Value& v : values) {
    Cluster<Value> c = about(about(v).mean);
    if (c.members.size() > best.members.size() ||
        (c.members.size() == best.members.size() && size_of(c.mean) < size_of(best.mean)))
      best = std::move(c);
  }
  return best;
}

/// Standard deviation of the core of some numbers, whatever the rest of them is: the shortest interval that holds
/// kCoreShare of them, as wide as that share of a normal distribution. (Least median of squares, Rousseeuw, J. Am.
/// Stat. Assoc. 79 (1984) 871–880, with another share, as less than half may lie right.) Fewer than kFewestForSpread:
/// 0.
inline constexpr double kCoreShare = 0.3;
inline constexpr std::size_t kFewestForSpread = 8;
double inner_spread(std::vector<double> values);

}  // namespace brachy
