#pragma once

#include <string>
#include <vector>

#include "core/plan/template_grid.h"
#include "core/structures/structure.h"

namespace brachy {

/// A hole of the template whose needle, along +z, passes through the gland.
struct GlandHole {
  std::string name;
  Vec3 position;  ///< of the hole, mm, world
  double near_mm,
      far_mm;  ///< beyond the template: where the needle enters the gland, and where it leaves it for good
  double depth_mm;    ///< the most that it has of gland around it on its way: small at the rim
  double urethra_mm;  ///< the least distance to the urethra's surface on its way within the gland
};

/// All of them, column by column. `structures`: the first is the gland; without a "urethra" one of 3 mm radius is
/// taken to run along z through the middle of the gland's box. Errors: UserError where the template lies beside or
/// not before the gland, with where it should be.
std::vector<GlandHole> find_gland_holes(const std::vector<Structure>& structures, const TemplateGrid& grid);

}  // namespace brachy
