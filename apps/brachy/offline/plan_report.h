#pragma once

#include <string>

#include "apps/score/dose_score.h"
#include "core/brachytherapy/plan/plan.h"

namespace brachy {

/// The report of `brachy plan`.
struct PlanReport {
  Plan plan;
  TemplateGrid grid;
  DoseStage dose;          ///< of its seeds at their planned positions, at rest
  double customary_u = 0;  ///< 2.15 d² U, d the gland's mean dimension in cm (core/DESIGN.md, section 6)

  double total_u() const { return static_cast<double>(plan.seed_count()) * plan.air_kerma_strength_u; }
};

std::string to_text(const PlanReport& report);
std::string to_json(const PlanReport& report);  ///< one line

}  // namespace brachy
