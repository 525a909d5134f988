#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// Requirements of a generated plan.
struct HdrPlanSettings {
  std::string name;  ///< one line
  SourceModel source = SourceModel::kMicroSelectronV2;
  ImplantSettings implant;
  double prescription_gy = ImplantSettings::kFractionGy;
  double needle_length_mm = 200;
};

/// A plan for any gland, `structures.front()`: dwell times of all holes that lead through it, at least 3 mm beside the
/// urethra, are optimised (dwell_optimiser.h), the catheters with the least time left out, and so on, until
/// implant.max_catheters remain; then the times of these. The first dwell position is at most 1 mm short of where the
/// catheter leaves the gland, its tip tip_offset_mm beyond, in whole mm.
/// Deterministic. Under 2 s. Errors: UserError where the template does not face the gland, no hole is suitable, or the
/// gland's base is farther from the template than a needle reaches. Goals that are not reached are missed: `brachy
/// plan` reports it. `progress`, if any, is called with the share that is done.
HdrPlan generate_hdr_plan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                          const HdrPlanSettings& settings,
                          const std::function<void(double share)>& progress = {});

}  // namespace brachy
