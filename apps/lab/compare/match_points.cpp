#include "apps/lab/compare/match_points.h"

#include <algorithm>
#include <numeric>

namespace brachy {
namespace {

bool precedes(const Vec3& a, const Vec3& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

std::vector<std::uint32_t> sorted_order(std::span<const Vec3> points) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) { return precedes(points[a], points[b]); });
  return order;
}

}  // namespace

std::vector<std::uint32_t> match_points(std::span<const Vec3> ours, std::span<const Vec3> given) {
  const auto sorted_ours = sorted_order(ours), sorted_given = sorted_order(given);
  std::vector<std::uint32_t> order(ours.size());
  for (std::size_t i = 0; i < ours.size(); ++i) order[sorted_ours[i]] = sorted_given[i];
  return order;
}

}  // namespace brachy
