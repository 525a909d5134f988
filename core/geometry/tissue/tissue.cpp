#include "core/geometry/tissue/tissue.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <numeric>

namespace brachy {
namespace {

bool lexicographically_less(const Vec3& a, const Vec3& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

/// Orders points [first, last) so that every run of kGroup, of 2 kGroup, of 4 kGroup … from `first` on is
/// compact: split at the median across the longest side of their box, the left part taking the largest power
/// of two of groups that leaves some for the right. A total order breaks ties, so the result does not depend
/// on the order given.
void order_compactly(std::vector<Vec3>& points, std::size_t first, std::size_t last) {
  constexpr std::size_t kGroup = 16;
  const auto begin = points.begin() + static_cast<std::ptrdiff_t>(first),
             end = points.begin() + static_cast<std::ptrdiff_t>(last);
  const std::size_t groups = (last - first + kGroup - 1) / kGroup;
  if (groups <= 1) {
    std::sort(begin, end, lexicographically_less);
    return;
  }
  Vec3 min = *begin, max = *begin;
  for (auto p = begin; p != end; ++p) {
    min = min.cwiseMin(*p);
    max = max.cwiseMax(*p);
  }
  Eigen::Index axis = 0;
  (max - min).maxCoeff(&axis);
  const std::size_t middle = first + kGroup * (std::bit_ceil(groups) / 2);
  std::nth_element(begin, points.begin() + static_cast<std::ptrdiff_t>(middle), end,
                   [&](const Vec3& a, const Vec3& b) {
                     return a[axis] != b[axis] ? a[axis] < b[axis] : lexicographically_less(a, b);
                   });
  order_compactly(points, first, middle);
  order_compactly(points, middle, last);
}

/// Cuts points [first, last) into blocks.
void add_blocks(Tissue& tissue, std::size_t first, std::size_t last) {
  while (first < last) {
    const std::size_t end = std::min(first + Tissue::kBlockSize, last);
    Block block{static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(end - first),
                tissue.rest_vertices[first], tissue.rest_vertices[first]};
    for (; first < end; ++first) {
      block.min = block.min.cwiseMin(tissue.rest_vertices[first]);
      block.max = block.max.cwiseMax(tissue.rest_vertices[first]);
    }
    tissue.blocks.push_back(block);
  }
}

}  // namespace

Tissue build_tissue(const SurfaceMesh& surface, const std::vector<Vec3>& interior_points) {
  Tissue tissue;
  tissue.surface_count = surface.vertices.size();
  tissue.rest_vertices = surface.vertices;
  tissue.rest_vertices.insert(tissue.rest_vertices.end(), interior_points.begin(), interior_points.end());
  order_compactly(tissue.rest_vertices, 0, tissue.surface_count);
  order_compactly(tissue.rest_vertices, tissue.surface_count, tissue.size());

  // Vertices are identified by position: a prepared surface has no two at the same one.
  std::vector<std::uint32_t> sorted_old(tissue.surface_count), sorted_new(tissue.surface_count);
  const auto sort_by_position = [](std::vector<std::uint32_t>& order, const std::vector<Vec3>& points) {
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return lexicographically_less(points[a], points[b]); });
  };
  sort_by_position(sorted_old, surface.vertices);
  sort_by_position(sorted_new, tissue.rest_vertices);
  std::vector<std::uint32_t> new_index(tissue.surface_count);
  for (std::size_t i = 0; i < tissue.surface_count; ++i) new_index[sorted_old[i]] = sorted_new[i];

  tissue.triangles.reserve(surface.triangles.size());
  for (const Triangle& t : surface.triangles) {
    assert(std::max({t[0], t[1], t[2]}) < new_index.size());
    tissue.triangles.push_back({new_index[t[0]], new_index[t[1]], new_index[t[2]]});
  }
  add_blocks(tissue, 0, tissue.surface_count);
  add_blocks(tissue, tissue.surface_count, tissue.size());
  return tissue;
}

}  // namespace brachy
