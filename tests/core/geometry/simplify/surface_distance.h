#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "core/geometry/surface/surface_bvh.h"

namespace brachy::test {

/// Every edge has two triangles, wound alike.
inline ::testing::AssertionResult is_closed_manifold(const SurfaceMesh& mesh) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<Edge> directed;
  directed.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    for (std::size_t n = 0; n < 3; ++n) directed.emplace_back(t[n], t[(n + 1) % 3]);
  std::ranges::sort(directed);
  const auto times = [&](const Edge& edge) {
    const auto [first, last] = std::equal_range(directed.begin(), directed.end(), edge);
    return last - first;
  };
  for (const Edge& edge : directed) {
    const auto there = times(edge), back = times({edge.second, edge.first});
    if (there != 1 || back != 1)
      return ::testing::AssertionFailure() << "edge " << edge.first << " " << edge.second << " occurs "
                                           << there << " times, and back " << back;
  }
  return mesh.triangles.empty() ? ::testing::AssertionFailure() << "empty" : ::testing::AssertionSuccess();
}

struct SurfaceDistance {
  double p95_mm = 0, most_mm = 0;
};

/// From the vertices and triangle centres of each surface to the other.
inline SurfaceDistance surface_distance(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceDistance result;
  for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    const SurfaceBvh surface(*to);
    std::vector<std::pair<double, double>> distances;  // and the area that the point stands for
    double area = 0;
    for (const auto& [i, j, k] : from->triangles) {
      const Vec3 &p = from->vertices[i], &q = from->vertices[j], &r = from->vertices[k];
      const double part = (q - p).cross(r - p).norm();
      area += part;
      for (const Vec3& x : {p, q, r, Vec3((p + q + r) / 3)})
        distances.emplace_back(std::abs(surface.closest_point(x).signed_distance), part / 4);
    }
    std::ranges::sort(distances);
    double sum = 0;
    for (const auto& [distance, part] : distances) {
      sum += part;
      if (sum <= 0.95 * area) continue;
      result.p95_mm = std::max(result.p95_mm, distance);
      break;
    }
    result.most_mm = std::max(result.most_mm, distances.back().first);
  }
  return result;
}

}  // namespace brachy::test
