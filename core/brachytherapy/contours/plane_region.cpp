#include "core/brachytherapy/contours/plane_region.h"

#include <algorithm>
#include <cmath>

namespace brachy {
namespace {

double cross(const Vec2& a, const Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Heights where edges of the two outlines, or of one, cross.
void add_crossings(std::span<const PlaneEdge> first, std::span<const PlaneEdge> second,
                   std::vector<double>& heights) {
  for (const PlaneEdge& a : first) {
    const Vec2 along = a[1] - a[0];
    const double low = std::min(a[0].y(), a[1].y()), high = std::max(a[0].y(), a[1].y());
    for (const PlaneEdge& b : second) {
      if (std::max(b[0].y(), b[1].y()) < low || std::min(b[0].y(), b[1].y()) > high) continue;
      const Vec2 other = b[1] - b[0], between = b[0] - a[0];
      const double turn = cross(along, other);
      if (turn == 0) continue;
      const double s = cross(between, other) / turn, t = cross(between, along) / turn;
      if (s > 0 && s < 1 && t > 0 && t < 1) heights.push_back(a[0].y() + s * along.y());
    }
  }
}

// Where a horizontal line at y crosses the outline, ascending.
void crossings_at(std::span<const PlaneEdge> edges, double y, std::vector<double>& x) {
  x.clear();
  for (const PlaneEdge& e : edges) {
    if ((e[0].y() > y) == (e[1].y() > y)) continue;
    x.push_back(e[0].x() + (y - e[0].y()) / (e[1].y() - e[0].y()) * (e[1].x() - e[0].x()));
  }
  std::ranges::sort(x);
}

double length_of(const std::vector<double>& x) {
  double length = 0;
  for (std::size_t k = 0; k + 1 < x.size(); k += 2) length += x[k + 1] - x[k];
  return length;
}

double common_length(const std::vector<double>& a, const std::vector<double>& b) {
  double length = 0;
  for (std::size_t i = 0, j = 0; i + 1 < a.size() && j + 1 < b.size();) {
    length += std::max(0.0, std::min(a[i + 1], b[j + 1]) - std::max(a[i], b[j]));
    (a[i + 1] < b[j + 1] ? i : j) += 2;
  }
  return length;
}

double distance_to(const Vec2& p, std::span<const PlaneEdge> edges) {
  double least = INFINITY;
  for (const PlaneEdge& e : edges) {
    const Vec2 along = e[1] - e[0];
    const double square = along.squaredNorm();
    const double t = square > 0 ? std::clamp((p - e[0]).dot(along) / square, 0.0, 1.0) : 0;
    least = std::min(least, (p - e[0] - t * along).squaredNorm());
  }
  return std::sqrt(least);
}

}  // namespace

RegionAreas region_areas(std::span<const PlaneEdge> first, std::span<const PlaneEdge> second) {
  std::vector<double> heights;
  for (const auto& edges : {first, second})
    for (const PlaneEdge& e : edges)
      for (const Vec2& end : e) heights.push_back(end.y());
  add_crossings(first, first, heights);
  add_crossings(first, second, heights);
  add_crossings(second, second, heights);
  std::ranges::sort(heights);
  RegionAreas areas;
  std::vector<double> a, b;
  for (std::size_t k = 0; k + 1 < heights.size(); ++k) {
    const double height = heights[k + 1] - heights[k];
    if (!(height > 0)) continue;
    const double y = heights[k] + 0.5 * height;
    crossings_at(first, y, a);
    crossings_at(second, y, b);
    areas.first += height * length_of(a);
    areas.second += height * length_of(b);
    areas.both += height * common_length(a, b);
  }
  return areas;
}

void add_outline_distances(std::span<const PlaneEdge> from, std::span<const PlaneEdge> to, double step_mm,
                           std::vector<OutlineDistance>& distances) {
  if (to.empty()) return;
  for (const PlaneEdge& e : from) {
    const double length = (e[1] - e[0]).norm();
    const auto pieces = std::max(1.0, std::ceil(length / step_mm));
    for (double k = 0; k < pieces; ++k) {
      const Vec2 p = e[0] + (k + 0.5) / pieces * (e[1] - e[0]);
      distances.push_back({distance_to(p, to), length / pieces});
    }
  }
}

double distance_quantile(std::vector<OutlineDistance>& distances, double share) {
  std::ranges::sort(distances, {}, &OutlineDistance::distance_mm);
  double length = 0, sum = 0;
  for (const OutlineDistance& d : distances) length += d.weight_mm;
  for (const OutlineDistance& d : distances) {
    sum += d.weight_mm;
    if (sum >= share * length * (1 - 1e-12)) return d.distance_mm;
  }
  return distances.empty() ? 0 : distances.back().distance_mm;
}

}  // namespace brachy
