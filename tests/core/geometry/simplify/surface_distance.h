#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "core/geometry/surface/surface_bvh.h"

namespace brachy::test {

/// Every edge has two triangles, wound alike.
inline ::testing::AssertionResult is_closed_manifold(const SurfaceMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t n = 0; n < 3; ++n) ++directed[{t[n], t[(n + 1) % 3]}];
  for (const auto& [edge, count] : directed) {
    const auto back = directed.find({edge.second, edge.first});
    if (count != 1 || back == directed.end() || back->second != 1)
      return ::testing::AssertionFailure()
             << "edge " << edge.first << " " << edge.second << " occurs " << count << " times, and back "
             << (back == directed.end() ? 0 : back->second);
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
