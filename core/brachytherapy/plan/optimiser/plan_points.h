#pragma once

#include <string>
#include <vector>

#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// How many points stand for each structure while a plan is being chosen.
struct PlanPointCounts {
  std::size_t gland = 3000, urethra = 256, rectum = 512, other = 256;
};

/// The points at which a plan's dose is watched: structure by structure, each padded to whole groups of kGroup for the
/// inner loops by repeating its last point, which counts only once.
struct PlanPoints {
  static constexpr std::size_t kGroup = 16;

  struct Part {
    std::string structure;
    std::size_t first = 0;  ///< in `points`, a multiple of kGroup
    std::size_t count = 0;  ///< without the padding
    double volume_cc = 0;   ///< of what the points stand for
    std::size_t padded() const { return (count + kGroup - 1) / kGroup * kGroup; }
  };
  std::vector<Vec3> points;  ///< mm, world
  std::vector<Part> parts;   ///< of the gland first
};

/// Points spread evenly over the gland (`structures.front()`), the urethra, and those parts of the rectum and of any
/// other structure that lie within 8 mm of the gland's box: farther away no seed reaches their limits. A
/// "pubic_arch" is bone and gets none, neither does a structure beyond that box. Deterministic.
PlanPoints plan_points(const std::vector<Structure>& structures, const PlanPointCounts& counts = {});

}  // namespace brachy
