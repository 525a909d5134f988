#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/brachytherapy/structures/structure.h"
#include "core/geometry/surface/surface_bvh.h"

namespace brachy {

/// A structure that needles are tested against in every tick: an organ at risk, or bone.
struct TestedOrgan {
  static constexpr const char* kBone = "pubic_arch";  ///< the name of the one that stops a needle

  std::string name;
  std::shared_ptr<const SurfaceBvh> surface;  ///< at rest, mm, world frame W
  bool is_bone = false;

  bool may_hold(const Vec3& p) const noexcept {
    return (p.array() >= surface->min().array()).all() && (p.array() <= surface->max().array()).all();
  }
};

/// All `structures` but the prostate, in their order; not real-time.
std::vector<TestedOrgan> tested_organs(const std::vector<Structure>& structures);
std::vector<std::string> names_of(const std::vector<TestedOrgan>& organs);

}  // namespace brachy
