#include "apps/landmarks/refusal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <vector>

#include "core/solve/rbf_system.h"

namespace brachy {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kPrecision = 1.01;  // of a radius or a spacing, as a factor

std::string number(double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

double least_distance(std::span<const Vec3> positions) {
  double least = kInfinite;
  for (std::size_t i = 1; i < positions.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) least = std::min(least, (positions[i] - positions[j]).norm());
  return least;
}

double estimate(const Kernel& kernel, std::span<const Vec3> positions, double support_radius) {
  RbfSystem system(kernel, support_radius, static_cast<int>(positions.size()));
  return system.factorize(positions) ? system.condition() : kInfinite;
}

/// Bisects between a length that works and one that does not, both > 0; the last that works.
template <class Does>
double bisect(double does, double does_not, Does&& check) {
  while (std::max(does, does_not) > kPrecision * std::min(does, does_not)) {
    const double middle = std::sqrt(does * does_not);
    (check(middle) ? does : does_not) = middle;
  }
  return does;
}

std::vector<std::size_t> thinned(std::span<const Vec3> positions, double spacing) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (std::ranges::none_of(kept,
                             [&](std::size_t k) { return (positions[k] - positions[i]).norm() < spacing; }))
      kept.push_back(i);
  return kept;
}

// `by`: the kernel, and what it is set to.
std::string reason(const FactorStatus& why, std::span<const Vec3> positions, const std::string& by) {
  switch (why.kind) {
    case FactorStatus::kOk:
      return "the landmark system can be solved";
    case FactorStatus::kNotFinite:
      return "landmark " + std::to_string(why.first) + " (from 0) has a coordinate that is not finite";
    case FactorStatus::kDuplicate:
      return "landmarks " + std::to_string(why.first) + " and " + std::to_string(why.second) +
             " (from 0) coincide within the solver's resolution";
    case FactorStatus::kNotPositiveDefinite:
      return "the landmark system of " + by + " is singular to rounding, with landmarks " +
             number(least_distance(positions)) + " mm apart";
    case FactorStatus::kIllConditioned:
      return "the landmark system of " + by + " is nearly singular, with landmarks " +
             number(least_distance(positions)) + " mm apart and a condition number of " +
             number(why.condition) + ", above " + number(FactorStatus::kMaxCondition);
  }
  return {};
}

bool is_crowded(const FactorStatus& why) {
  return why.kind == FactorStatus::kNotPositiveDefinite || why.kind == FactorStatus::kIllConditioned;
}

}  // namespace

double largest_stable_support(const Kernel& kernel, std::span<const Vec3> positions, double support_radius) {
  const auto does = [&](double a) { return estimate(kernel, positions, a) <= FactorStatus::kMaxCondition; };
  if (does(support_radius)) return support_radius;
  // Supports that end at the next landmark leave K = I.
  const double least = least_distance(positions);
  return least > 0 ? bisect(least, support_radius, does) : 0;
}

double least_stable_spacing(std::span<const Vec3> positions, const ConditionOf& condition_of) {
  const auto does = [&](double spacing) {
    return condition_of(thinned(positions, spacing)) <= FactorStatus::kMaxCondition;
  };
  double extent = 0;
  for (const Vec3& p : positions) extent = std::max(extent, (p - positions[0]).norm());
  if (extent == 0) return 0;
  const double widest = 2 * kPrecision * extent;  // leaves one landmark
  double least = least_distance(positions);
  if (!(least > 0)) least = 1e-9 * extent;
  return does(least) ? least : bisect(widest, least, does);
}

std::string explain_refusal(const FactorStatus& why, std::span<const Vec3> positions,
                            std::span<const Vec3> displacements, const Kernel& kernel,
                            double support_radius) {
  std::string text = reason(
      why, positions, std::string(name_of(kernel)) + " with a support of " + number(support_radius) + " mm");
  if (!is_crowded(why)) return text;

  double pushed = 0;
  for (const Vec3& d : displacements) pushed = std::max(pushed, d.norm());
  const double folds = max_slope(kernel) * pushed;
  const double largest = largest_stable_support(kernel, positions, support_radius);
  if (largest > folds)
    text += "; supports up to " + number(largest) + " mm can be solved" +
            (folds > 0 ? ", and from " + number(folds) + " mm on the largest displacement alone does not fold"
                       : "");
  else
    text += "; no support works: those up to " + number(largest) + " mm can be solved, but up to " +
            number(folds) + " mm the largest displacement alone folds";

  const double spacing = least_stable_spacing(positions, [&](std::span<const std::size_t> chosen) {
    std::vector<Vec3> p;
    for (const std::size_t i : chosen) p.push_back(positions[i]);
    return estimate(kernel, p, support_radius);
  });
  return text + "; landmarks thinned to " + number(spacing) + " mm apart can be solved";
}

std::string explain_refusal(const FactorStatus& why, std::span<const Vec3> positions,
                            std::string_view model_name, const ConditionOf& condition_of) {
  std::string text = reason(why, positions, std::string(model_name));
  if (!is_crowded(why)) return text;
  return text + "; landmarks thinned to " + number(least_stable_spacing(positions, condition_of)) +
         " mm apart can be solved";
}

}  // namespace brachy
