#include "core/geometry/contours/mesh_contours.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace brachy {
namespace {

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

}  // namespace

std::vector<Polygon> mesh_contours(const SurfaceMesh& mesh, double height_mm) {
  // In each triangle that crosses the plane the contour goes from one edge to another; wound outward, it goes the same
  // way round everywhere, so each crossed edge is left once.
  std::unordered_map<std::uint64_t, std::uint64_t> next;
  std::vector<std::uint64_t> order;
  const auto is_above = [&](std::uint32_t v) { return mesh.vertices[v].z() >= height_mm; };
  for (const Triangle& t : mesh.triangles) {
    std::uint64_t up = 0, down = 0;
    bool crosses = false;
    for (std::size_t n = 0; n < 3; ++n) {
      const std::uint32_t a = t[n], b = t[(n + 1) % 3];
      if (is_above(a) == is_above(b)) continue;
      crosses = true;
      (is_above(b) ? up : down) = edge_key(a, b);
    }
    if (crosses && next.emplace(up, down).second) order.push_back(up);
  }
  const auto crossing = [&](std::uint64_t key) {
    // From the lower to the higher index, so that both triangles of an edge compute the same bits.
    const Vec3 &a = mesh.vertices[key >> 32], &b = mesh.vertices[key & 0xffffffff];
    const double s = (height_mm - a.z()) / (b.z() - a.z());
    return Vec2((a + s * (b - a)).head<2>());
  };
  std::vector<Polygon> polygons;
  for (const std::uint64_t start : order) {
    Polygon polygon;
    std::uint64_t key = start;
    for (auto step = next.find(key); step != next.end(); step = next.find(key)) {
      const Vec2 p = crossing(key);
      if (polygon.empty() || (polygon.back() - p).norm() > 1e-6) polygon.push_back(p);
      key = step->second;
      next.erase(step);
    }
    while (polygon.size() > 1 && (polygon.back() - polygon.front()).norm() <= 1e-6) polygon.pop_back();
    if (polygon.size() >= 3) polygons.push_back(std::move(polygon));
  }
  return polygons;
}

std::vector<double> contour_heights(double min_mm, double max_mm, double spacing_mm) {
  constexpr double kNothing = 1e-3;  // a contour this near to an end may have no area
  const double first = std::ceil((min_mm + kNothing) / spacing_mm - 0.5);
  const double last = std::floor((max_mm - kNothing) / spacing_mm - 0.5);
  if (last < first) return {0.5 * (min_mm + max_mm)};
  std::vector<double> heights;
  for (double n = first; n <= last; ++n) heights.push_back((n + 0.5) * spacing_mm);
  return heights;
}

}  // namespace brachy
