#pragma once

#include <string>
#include <vector>

#include "core/brachytherapy/plan/template_grid.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// A hole of the template whose needle, along +z, passes through the gland.
struct GlandHole {
  std::string name;
  Vec3 position;      ///< of the hole, mm, world
  double near_mm;     ///< beyond the template: where the needle enters the gland
  double far_mm;      ///< beyond the template: where it finally leaves the gland
  double depth_mm;    ///< the largest distance to the gland's surface on its way: small at the rim
  double urethra_mm;  ///< the least distance to the urethra's surface on its way within the gland
};

/// All of them, column by column. `structures`: the first is the gland; without a "urethra", one of 3 mm radius is
/// assumed along z through the middle of the gland's box. Errors: UserError where the template is beside or not in
/// front of the gland, with the origin it should have.
std::vector<GlandHole> find_gland_holes(const std::vector<Structure>& structures, const TemplateGrid& grid);

}  // namespace brachy
