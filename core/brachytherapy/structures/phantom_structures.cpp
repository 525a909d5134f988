#include "core/brachytherapy/structures/phantom_structures.h"

#include <cmath>
#include <numbers>

namespace brachy {
namespace {

/// A tube in the plane x = 0 along y = back + bend (z − deepest)², from z = bottom to top; mm.
struct Tube {
  double radius, bottom, top;
  double back, bend = 0, deepest = 0;
  std::uint32_t around, along;  ///< faces

  Vec3 centre(double z) const { return {0, back + bend * (z - deepest) * (z - deepest), z}; }
  Vec3 tangent(double z) const { return Vec3(0, 2 * bend * (z - deepest), 1).normalized(); }
};

SurfaceMesh mesh_of(const Tube& tube) {
  SurfaceMesh mesh;
  for (std::uint32_t k = 0; k <= tube.along; ++k) {
    const double z = tube.bottom + (tube.top - tube.bottom) * k / tube.along;
    const Vec3 across = tube.tangent(z).cross(Vec3::UnitX());
    for (std::uint32_t i = 0; i < tube.around; ++i) {
      const double angle = 2 * std::numbers::pi * i / tube.around;
      mesh.vertices.push_back(tube.centre(z) +
                              tube.radius * (std::cos(angle) * Vec3::UnitX() + std::sin(angle) * across));
    }
  }
  const auto vertex = [&](std::uint32_t k, std::uint32_t i) { return k * tube.around + i % tube.around; };
  for (std::uint32_t k = 0; k < tube.along; ++k)
    for (std::uint32_t i = 0; i < tube.around; ++i) {
      mesh.triangles.push_back({vertex(k, i), vertex(k, i + 1), vertex(k + 1, i + 1)});
      mesh.triangles.push_back({vertex(k, i), vertex(k + 1, i + 1), vertex(k + 1, i)});
    }
  const auto bottom = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(tube.centre(tube.bottom));
  mesh.vertices.push_back(tube.centre(tube.top));
  for (std::uint32_t i = 0; i < tube.around; ++i) {
    mesh.triangles.push_back({bottom, vertex(0, i + 1), vertex(0, i)});
    mesh.triangles.push_back({bottom + 1, vertex(tube.along, i), vertex(tube.along, i + 1)});
  }
  return mesh;
}

}  // namespace

SurfaceMesh phantom_urethra() {
  return mesh_of({.radius = 3,
                  .bottom = -25.5,
                  .top = 24.5,
                  .back = -4,
                  .bend = 0.0095,
                  .deepest = -3,
                  .around = 24,
                  .along = 25});
}

SurfaceMesh phantom_rectum() {
  return mesh_of({.radius = 13.5, .bottom = -37.5, .top = 37.5, .back = -36.5, .around = 48, .along = 20});
}

}  // namespace brachy
