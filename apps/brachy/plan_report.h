#pragma once

#include <string>

#include "apps/score/dose_score.h"
#include "core/plan/plan.h"

namespace brachy {

/// What `brachy plan` says of a plan.
struct PlanReport {
  Plan plan;
  TemplateGrid grid;
  DoseStage dose;          ///< of its seeds where it wants them, at rest
  double customary_u = 0;  ///< 2.15 d² U, d the gland's mean dimension in cm (DESIGN §6)

  double total_u() const { return static_cast<double>(plan.seed_count()) * plan.air_kerma_strength_u; }
};

std::string to_text(const PlanReport& report);
std::string to_json(const PlanReport& report);  ///< one line

}  // namespace brachy
