#include "core/geometry/mesh_io/polygon.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>

namespace brachy {
namespace {

constexpr std::uint32_t kNoCorner = 0xFFFFFFFFu;

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

  /// Area over squared longest side, or −∞ where this is no ear; then `blocker` is the corner within it, or kNoCorner.
  double quality(const std::array<std::uint32_t, 3>& t, std::uint32_t& blocker, std::size_t& work) const {
    constexpr double kNone = -std::numeric_limits<double>::infinity();
    blocker = kNoCorner;
    const double area = twice_area(t[0], t[1], t[2]);
    if (!(area > 0)) return kNone;
    for (const std::uint32_t v : left) {
      ++work;
      const bool own =
          corners[v] == corners[t[0]] || corners[v] == corners[t[1]] || corners[v] == corners[t[2]];
      if (own || !contains(t, v)) continue;
      blocker = v;
      return kNone;
    }
    const auto side = [&](std::size_t k) { return (corners[t[(k + 1) % 3]] - corners[t[k]]).squaredNorm(); };
    return area / std::max({side(0), side(1), side(2)});
  }
};

/// The quality of the ear at each remaining corner. It changes only beside the ear that was cut off, and where the
/// corner that blocked an ear is gone.
struct Ears {
  std::vector<double> quality;
  std::vector<std::uint32_t> blocker;

  Ears(const Clipper& clipper, std::size_t& work) : quality(clipper.left.size()), blocker(quality.size()) {
    for (std::size_t i = 0; i < quality.size(); ++i) update(clipper, i, work);
  }
  void update(const Clipper& clipper, std::size_t i, std::size_t& work) {
    quality[i] = clipper.quality(clipper.ear(i), blocker[i], work);
  }
  /// Corner `i` of those that remained, which was `corner`, has been cut off.
  void remove(const Clipper& clipper, std::size_t i, std::uint32_t corner, std::size_t& work) {
    quality.erase(quality.begin() + static_cast<std::ptrdiff_t>(i));
    blocker.erase(blocker.begin() + static_cast<std::ptrdiff_t>(i));
    const std::size_t n = quality.size(), before = (i + n - 1) % n, behind = i % n;
    for (std::size_t k = 0; k < n; ++k)
      if (k == before || k == behind || blocker[k] == corner) update(clipper, k, work);
  }
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(std::span<const Vec3> corners,
                                                              std::size_t& work) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  if (corners.size() < 3) return triangles;
  Clipper clipper(corners);
  if (corners.size() > 3 && corners.size() <= 100) {
    for (Ears ears(clipper, work); clipper.left.size() > 3;) {
      const auto best = std::max_element(ears.quality.begin(), ears.quality.end());
      if (!(*best > 0)) break;
      const auto i = static_cast<std::size_t>(best - ears.quality.begin());
      const std::uint32_t corner = clipper.left[i];
      triangles.push_back(clipper.ear(i));
      clipper.left.erase(clipper.left.begin() + static_cast<std::ptrdiff_t>(i));
      ears.remove(clipper, i, corner, work);
    }
  }
  const auto& left = clipper.left;
  for (std::size_t i = 2; i < left.size(); ++i) triangles.push_back({left[0], left[i - 1], left[i]});
  return triangles;
}

}  // namespace brachy
