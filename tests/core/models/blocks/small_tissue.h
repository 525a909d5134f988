#pragma once

#include <vector>

#include "core/models/blocks/block_field.h"
#include "core/scene/load_tissue.h"

namespace brachy::test {

/// A phantom of 2,000 points, moved to `at`.
inline Tissue small_phantom(const Vec3& at) {
  Scene scene;
  scene.tissue.phantom_surface_vertices = 300;
  scene.tissue.points = 2000;
  Tissue tissue = load_tissue(scene).tissue;
  for (Vec3& X : tissue.rest_vertices) X += at;
  for (Block& block : tissue.blocks) {
    block.min += at;
    block.max += at;
  }
  return tissue;
}

/// u of every point as a BlockField left it, mm; zero out of reach.
inline std::vector<Vec3> displacements_of(const BlockField& field, const Tissue& tissue) {
  std::vector<Vec3> u(tissue.size(), Vec3::Zero());
  for (const std::uint32_t b : field.touched()) {
    const Block& block = tissue.blocks[b];
    const BlockDisplacement<float>& d = field.displacement(b);
    for (std::uint32_t i = 0; i < block.count; ++i) u[block.first + i] = Vec3(d.ux[i], d.uy[i], d.uz[i]);
  }
  return u;
}

inline std::vector<SimdTarget> supported_targets() {
  std::vector<SimdTarget> targets;
  for (SimdTarget t : {SimdTarget::kGeneric, SimdTarget::kSse4, SimdTarget::kAvx2, SimdTarget::kAvx512})
    if (is_supported(t)) targets.push_back(t);
  return targets;
}

}  // namespace brachy::test
