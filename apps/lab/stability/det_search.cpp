#include "apps/lab/stability/det_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace brachy {
namespace {

double det_of(const Mat3& gradient, double push) {
  return (Mat3::Identity() + push * gradient).determinant();
}

/// The state of one compass search.
struct Descent {
  Vec3 at;
  double value, step;
};

}  // namespace

const std::vector<Vec3>& compass() {
  static const std::vector<Vec3> directions = [] {
    std::vector<Vec3> all;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          if (x != 0 || y != 0 || z != 0) all.push_back(Vec3(x, y, z).normalized());
    return all;
  }();
  return directions;
}

DetSearch::DetSearch(Gradients of_unit_push, std::vector<Vec3> samples, double reach, Counts counts)
    : gradients_(std::move(of_unit_push)),
      samples_(std::move(samples)),
      reach_(reach),
      counts_(std::move(counts)) {
  if (counts_) std::erase_if(samples_, [this](const Vec3& X) { return !counts_(X); });
  of_samples_ = gradients_(samples_);
}

// All descents advance together: a call of `gradients_` may cost as much for one point as for a hundred (fem solves
// its mesh).
DetSearch::Found DetSearch::extreme(double push, double sign) {
  constexpr std::size_t kDescents = 4, kLookedAt = 200;
  constexpr double kLeastStep = 1e-3;  // of the reach
  std::vector<double> value(samples_.size());
  for (std::size_t i = 0; i < value.size(); ++i) value[i] = sign * det_of(of_samples_[i], push);
  std::vector<std::size_t> order(value.size());
  std::iota(order.begin(), order.end(), 0u);
  order.resize(std::min(order.size(), kLookedAt));
  std::vector<std::size_t> all(value.size());
  std::iota(all.begin(), all.end(), 0u);
  std::ranges::partial_sort_copy(
      all, order, {}, [&](std::size_t i) { return value[i]; }, [&](std::size_t i) { return value[i]; });

  std::vector<Descent> descents;  // from the best, each beyond the others' reach
  for (const std::size_t i : order) {
    const auto is_near = [&](const Descent& d) { return (d.at - samples_[i]).norm() < reach_; };
    if (descents.size() < kDescents && std::ranges::none_of(descents, is_near))
      descents.push_back({samples_[i], value[i], reach_});
  }
  for (;;) {
    std::vector<Vec3> around;
    std::vector<std::size_t> whose;
    for (std::size_t d = 0; d < descents.size(); ++d)
      for (const Vec3& direction : compass()) {
        const Vec3 X = descents[d].at + descents[d].step * direction;
        if (descents[d].step <= kLeastStep * reach_ || (counts_ && !counts_(X))) continue;
        around.push_back(X);
        whose.push_back(d);
      }
    if (around.empty()) break;
    const std::vector<Mat3> gradients = gradients_(around);
    std::vector<std::size_t> better(descents.size(), around.size());
    for (std::size_t i = 0; i < around.size(); ++i) {
      Descent& descent = descents[whose[i]];
      const double here = sign * det_of(gradients[i], push);
      if (!(here < descent.value)) continue;
      descent.value = here;
      better[whose[i]] = i;
    }
    for (std::size_t d = 0; d < descents.size(); ++d) {
      if (better[d] == around.size()) {
        descents[d].step /= 2;
        continue;
      }
      descents[d].at = around[better[d]];
      samples_.push_back(around[better[d]]);
      of_samples_.push_back(gradients[better[d]]);
    }
  }
  const Descent& best = *std::ranges::min_element(descents, {}, &Descent::value);
  return {sign * best.value, best.at};
}

double DetSearch::least_known(double push) const {
  double least = std::numeric_limits<double>::infinity();
  for (const Mat3& gradient : of_samples_) least = std::min(least, det_of(gradient, push));
  return least;
}

// Bisection over the samples, then descents at the fold found, which may find an earlier fold; repeated until they do
// not.
std::optional<double> DetSearch::fold(double most_push) {
  constexpr double kSettled = 1e-3;
  const auto known_fold = [&] {
    return push_at_fold([this](double p) { return least_known(p); }, most_push);
  };
  std::optional<double> push = known_fold();
  for (;;) {
    least(push.value_or(most_push));
    const auto sooner = known_fold();
    if (!sooner || (push && *sooner > (1 - kSettled) * *push)) return sooner;
    push = sooner;
  }
}

std::vector<Vec3> samples_around(std::span<const Vec3> positions, double scale, std::size_t lattice_points) {
  constexpr std::array kShells = {1e-3, 0.03, 0.07, 0.12, 0.18, 0.24, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0};
  std::vector<Vec3> samples;
  Vec3 min = positions.front(), max = min;
  for (const Vec3& p : positions) {
    min = min.cwiseMin(p - Vec3::Constant(scale));
    max = max.cwiseMax(p + Vec3::Constant(scale));
    for (const double shell : kShells)
      for (const Vec3& direction : compass()) samples.push_back(p + shell * scale * direction);
  }
  const double spacing = std::cbrt((max - min).prod() / static_cast<double>(lattice_points));
  const Eigen::Array3i count = ((max - min) / spacing).array().ceil().cast<int>();
  for (int x = 0; x < count.x(); ++x)
    for (int y = 0; y < count.y(); ++y)
      for (int z = 0; z < count.z(); ++z)
        samples.emplace_back(min + spacing * Vec3(x + 0.5, y + 0.5, z + 0.5));
  return samples;
}

std::optional<double> push_at_fold(const std::function<double(double push)>& least_det, double most) {
  constexpr double kWithin = 5e-4;
  double low = 0, high = most / 64;
  while (least_det(high) > 0) {
    if (high >= most) return std::nullopt;
    low = high;
    high = std::min(2 * high, most);
  }
  while (high - low > kWithin * high) {
    const double middle = 0.5 * (low + high);
    (least_det(middle) > 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace brachy
