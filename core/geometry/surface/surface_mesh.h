#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

using Triangle = std::array<std::uint32_t, 3>;

/// A triangle surface; vertices in mm, world frame (RAS). Corners counter-clockwise seen from outside once
/// prepare_surface has oriented it.
struct SurfaceMesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
};

}  // namespace brachy
