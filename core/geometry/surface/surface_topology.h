#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// Vertices welded by position. Representatives are in lexicographic order of position.
struct Welding {
  std::vector<Vec3> vertices;                 ///< mm, pairwise farther apart than the tolerance
  std::vector<std::uint32_t> representative;  ///< of each input vertex, index in `vertices`
};

/// In lexicographic order of position each vertex joins the first representative within the tolerance (mm, ≥ 0), or
/// becomes one. Independent of the input's order. O(n log n). Vertices must be finite.
Welding weld_vertices(const std::vector<Vec3>& vertices, double tolerance_mm);

/// How the triangles are connected; per-triangle vectors are indexed as the triangles given.
struct SurfaceTopology {
  std::vector<std::uint32_t> component;  ///< triangles that share an edge share a component; numbered from 0
  std::vector<std::uint32_t> patch;      ///< the same over edges with exactly two triangles
  std::vector<bool> flipped;             ///< the winding must be reversed to agree with the patch
  std::size_t component_count = 0, patch_count = 0;

  /// Of each component: edges with one triangle, with three or more, with two that are not orientable.
  struct EdgeCount {
    std::size_t open = 0, nonmanifold = 0, twisted = 0;
    std::size_t bad() const { return open + nonmanifold + twisted; }
  };
  std::vector<EdgeCount> edges;
};

/// O(n log n) in the triangles, whose corners must be distinct.
SurfaceTopology analyse_topology(const std::vector<Triangle>& triangles);

}  // namespace brachy
