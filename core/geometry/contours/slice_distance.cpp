#include "core/geometry/contours/slice_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace brachy {
namespace {

struct Edge2 {
  Vec2 a, b;
};

double distance_to(const Edge2& edge, const Vec2& p) {
  const Vec2 d = edge.b - edge.a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - edge.a).dot(d) / length2, 0.0, 1.0) : 0;
  return (edge.a + t * d - p).norm();
}

constexpr std::uint32_t kNoEdge = std::numeric_limits<std::uint32_t>::max();

class NearestEdges {
 public:
  NearestEdges(const std::vector<Edge2>& edges, const SliceGrid& grid)
      : edges_(edges),
        grid_(grid),
        nearest_(grid.size[0] * grid.size[1], kNoEdge),
        distance_(nearest_.size(), std::numeric_limits<float>::max()) {
    for (std::uint32_t e = 0; e < edges.size(); ++e) seed(e);
    for (int round = 0; round < 2; ++round) {
      sweep(false);
      sweep(true);
    }
  }

  std::vector<float> distances() && { return std::move(distance_); }

 private:
  void seed(std::uint32_t e);
  void sweep(bool backwards);
  void offer(std::size_t i, std::size_t j, std::uint32_t edge) {
    const std::size_t at = j * grid_.size[0] + i;
    if (edge == kNoEdge || nearest_[at] == edge) return;
    const auto d = static_cast<float>(distance_to(edges_[edge], grid_.position(i, j)));
    if (d >= distance_[at]) return;
    distance_[at] = d;
    nearest_[at] = edge;
  }

  const std::vector<Edge2>& edges_;
  const SliceGrid& grid_;
  std::vector<std::uint32_t> nearest_;
  std::vector<float> distance_;
};

/// The points within about a pitch of an edge, piece by piece along it.
void NearestEdges::seed(std::uint32_t e) {
  const Vec2 along = edges_[e].b - edges_[e].a;
  const auto pieces = static_cast<std::size_t>(along.norm() / grid_.pitch_mm) + 1;
  for (std::size_t piece = 0; piece < pieces; ++piece) {
    const Vec2 a = edges_[e].a + along * (static_cast<double>(piece) / static_cast<double>(pieces));
    const Vec2 b = edges_[e].a + along * (static_cast<double>(piece + 1) / static_cast<double>(pieces));
    std::array<std::size_t, 2> low{}, high{};
    for (int k = 0; k < 2; ++k) {
      const double last = static_cast<double>(grid_.size[static_cast<std::size_t>(k)] - 1);
      const double from = (std::min(a[k], b[k]) - grid_.origin[k]) / grid_.pitch_mm - 1;
      const double to = (std::max(a[k], b[k]) - grid_.origin[k]) / grid_.pitch_mm + 1;
      low[static_cast<std::size_t>(k)] = static_cast<std::size_t>(std::clamp(std::floor(from), 0.0, last));
      high[static_cast<std::size_t>(k)] = static_cast<std::size_t>(std::clamp(std::ceil(to), 0.0, last));
    }
    for (std::size_t j = low[1]; j <= high[1]; ++j)
      for (std::size_t i = low[0]; i <= high[0]; ++i) offer(i, j, e);
  }
}

void NearestEdges::sweep(bool backwards) {
  const auto [nx, ny] = grid_.size;
  for (std::size_t row = 0; row < ny; ++row) {
    const std::size_t j = backwards ? ny - 1 - row : row;
    const bool has_before = row > 0;
    const std::size_t before = backwards ? j + 1 : j - 1;
    for (std::size_t i = 0; i < nx; ++i) {
      if (!has_before) break;
      for (std::size_t x = i > 0 ? i - 1 : 0; x <= std::min(i + 1, nx - 1); ++x)
        offer(i, j, nearest_[before * nx + x]);
    }
    for (std::size_t i = 1; i < nx; ++i) offer(i, j, nearest_[j * nx + i - 1]);
    for (std::size_t i = nx - 1; i-- > 0;) offer(i, j, nearest_[j * nx + i + 1]);
  }
}

}  // namespace

std::vector<float> slice_distance(std::span<const Polygon> polygons, const SliceGrid& grid) {
  std::vector<Edge2> edges;
  for (const Polygon& polygon : polygons)
    for (std::size_t i = 0; i < polygon.size(); ++i)
      edges.push_back({polygon[i], polygon[(i + 1) % polygon.size()]});
  std::vector<float> distance = NearestEdges(edges, grid).distances();
  const auto [nx, ny] = grid.size;
  std::vector<std::vector<double>> crossings(ny);
  for (const auto& [a, b] : edges) {
    // A row crosses an edge whose lower end is on or below it and whose upper end is above it.
    const double low = (std::min(a.y(), b.y()) - grid.origin.y()) / grid.pitch_mm;
    const double high = (std::max(a.y(), b.y()) - grid.origin.y()) / grid.pitch_mm;
    for (auto j = static_cast<std::size_t>(std::max(0.0, std::ceil(low)));
         j < ny && static_cast<double>(j) < high; ++j) {
      const double y = grid.origin.y() + grid.pitch_mm * static_cast<double>(j);
      crossings[j].push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
  }
  for (std::size_t j = 0; j < ny; ++j) {
    std::ranges::sort(crossings[j]);
    std::size_t passed = 0;
    for (std::size_t i = 0; i < nx; ++i) {
      while (passed < crossings[j].size() && crossings[j][passed] <= grid.position(i, j).x()) ++passed;
      if (passed % 2 != 0) distance[j * nx + i] = -distance[j * nx + i];
    }
  }
  return distance;
}

}  // namespace brachy
