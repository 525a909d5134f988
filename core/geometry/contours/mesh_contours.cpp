#include "core/geometry/contours/mesh_contours.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace brachy {
namespace {

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

/// Counter-clockwise or clockwise.
Polygon wound(Polygon polygon, bool counter_clockwise) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    twice += p.x() * q.y() - p.y() * q.x();
  }
  if ((twice > 0) != counter_clockwise) std::ranges::reverse(polygon);
  return polygon;
}

/// The outer contour with a channel to each hole, the nearest one first, so that channels do not cross.
Polygon joined(Polygon outer, std::vector<Polygon> holes) {
  while (!holes.empty()) {
    std::size_t nearest = 0, from = 0, to = 0;
    double least = std::numeric_limits<double>::max();
    for (std::size_t h = 0; h < holes.size(); ++h)
      for (std::size_t i = 0; i < outer.size(); ++i)
        for (std::size_t j = 0; j < holes[h].size(); ++j)
          if (const double away = (outer[i] - holes[h][j]).squaredNorm(); away < least) {
            least = away;
            nearest = h;
            from = i;
            to = j;
          }
    Polygon& hole = holes[nearest];
    std::rotate(hole.begin(), hole.begin() + static_cast<std::ptrdiff_t>(to), hole.end());
    hole.push_back(hole.front());
    hole.push_back(outer[from]);
    outer.insert(outer.begin() + static_cast<std::ptrdiff_t>(from) + 1, hole.begin(), hole.end());
    holes.erase(holes.begin() + static_cast<std::ptrdiff_t>(nearest));
  }
  return outer;
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

std::vector<Polygon> with_keyholes(const std::vector<Polygon>& polygons) {
  std::size_t pairs = 0;
  const std::vector<PlaneShape> shapes = plane_shapes(polygons, "contours", pairs);
  std::vector<Polygon> result;
  for (const PlaneShape& outer : shapes) {
    if (outer.is_hole()) continue;
    if (outer.polygons.size() > 1) {
      result.insert(result.end(), outer.polygons.begin(), outer.polygons.end());
      continue;
    }
    std::vector<Polygon> holes;
    for (const PlaneShape& hole : shapes)
      if (hole.depth == outer.depth + 1 && outer.contains(hole.polygons.front().front()))
        for (const Polygon& polygon : hole.polygons) holes.push_back(wound(polygon, false));
    result.push_back(joined(wound(outer.polygons.front(), true), std::move(holes)));
  }
  return result;
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
