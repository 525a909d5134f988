#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// Points [first, first + count) that lie close together; the unit of culling, change tracking and sending.
/// Bounds are of the rest positions, mm.
struct Block {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  Vec3 min, max;

  /// Squared distance of p from the box, mm²; 0 inside.
  double squared_distance(const Vec3& p) const {
    return (min - p).cwiseMax(p - max).cwiseMax(0.0).squaredNorm();
  }
};

/// The tissue at rest: surface vertices [0, surface_count), then interior points, each part in the order of a k-d tree
/// and cut into blocks of kBlockSize (the last one of a part may be smaller); no block straddles the two
/// parts. Immutable after build_tissue.
struct Tissue {
  static constexpr std::size_t kBlockSize = 64;

  std::size_t surface_count = 0;
  std::vector<Vec3> rest_vertices;  ///< N points, mm, world frame
  std::vector<Triangle> triangles;  ///< of the surface, indices < surface_count, outward
  std::vector<Block> blocks;

  std::size_t size() const { return rest_vertices.size(); }
};

/// Orders a prepared (closed, outward) surface and its interior points into a Tissue.
Tissue build_tissue(const SurfaceMesh& surface, const std::vector<Vec3>& interior_points);

}  // namespace brachy
