#include "core/geometry/mesh_io/polygon.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>

namespace brachy {
namespace {

/// A polygon's remaining corners, seen along its normal.
struct Clipper {
  std::span<const Vec3> corners;
  Vec3 normal = Vec3::Zero();  ///< Newell's: twice the area, mm²
  std::vector<std::uint32_t> left;

  explicit Clipper(std::span<const Vec3> polygon) : corners(polygon), left(polygon.size()) {
    std::iota(left.begin(), left.end(), 0u);
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      normal += (polygon[i] - polygon[0]).cross(polygon[(i + 1) % polygon.size()] - polygon[0]);
    }
  }

  double twice_area(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(normal);
  }

  std::array<std::uint32_t, 3> ear(std::size_t i) const {
    const std::size_t n = left.size();
    return {left[(i + n - 1) % n], left[i], left[(i + 1) % n]};
  }

  bool contains(const std::array<std::uint32_t, 3>& t, std::uint32_t v) const {
    return twice_area(t[0], t[1], v) >= 0 && twice_area(t[1], t[2], v) >= 0 && twice_area(t[2], t[0], v) >= 0;
  }

  /// Area over squared longest side, or −∞ where this is no ear.
  double quality(const std::array<std::uint32_t, 3>& t) const {
    const double area = twice_area(t[0], t[1], t[2]);
    if (!(area > 0)) return -std::numeric_limits<double>::infinity();
    for (const std::uint32_t v : left) {
      const bool own =
          corners[v] == corners[t[0]] || corners[v] == corners[t[1]] || corners[v] == corners[t[2]];
      if (!own && contains(t, v)) return -std::numeric_limits<double>::infinity();
    }
    const auto side = [&](std::size_t k) { return (corners[t[(k + 1) % 3]] - corners[t[k]]).squaredNorm(); };
    return area / std::max({side(0), side(1), side(2)});
  }
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(std::span<const Vec3> corners) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  if (corners.size() < 3) return triangles;
  Clipper clipper(corners);
  while (clipper.left.size() > 3 && corners.size() <= 100) {
    std::size_t best = 0;
    double best_quality = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < clipper.left.size(); ++i) {
      const double quality = clipper.quality(clipper.ear(i));
      if (quality > best_quality) best = i, best_quality = quality;
    }
    if (!(best_quality > 0)) break;
    triangles.push_back(clipper.ear(best));
    clipper.left.erase(clipper.left.begin() + static_cast<std::ptrdiff_t>(best));
  }
  const auto& left = clipper.left;
  for (std::size_t i = 2; i < left.size(); ++i) triangles.push_back({left[0], left[i - 1], left[i]});
  return triangles;
}

}  // namespace brachy
