#pragma once

#include <string>
#include <vector>

#include "core/brachytherapy/plan/gland_holes.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/plan/template_grid.h"

namespace brachy {

/// A needle through one hole with seeds every 10 mm from the far end of its way through the gland,
/// `structures.front()`, to the near one, their centres within: uniform loading (AAPM TG-64, Yu et al., Med. Phys.
/// 26, 1999, 2054–2076). Its tip stops in whole mm beyond the template. What a planner begins with who adds a
/// needle by hand.
struct HoleLoading {
  double depth_mm = 0;  ///< of the tip beyond the template
  std::string train;    ///< PlanNeedle::train
};

/// `holes`: all of the gland (find_gland_holes). Errors: UserError "hole …: …" where there is no such hole or its
/// needle does not pass through the gland.
HoleLoading load_hole(const std::vector<GlandHole>& holes, const TemplateGrid& grid, const std::string& hole);

}  // namespace brachy
