#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/brachytherapy/plan/optimiser/optimise_plan.h"
#include "core/geometry/surface/surface_volume.h"

namespace brachy {

/// What was asked for cannot be planned: the message has the reason, and the nearest thing that can be.
class PlanRefused : public UserError {
 public:
  using UserError::UserError;
};

enum class PlanMethod {
  kAnnealing,  ///< optimise_plan
  kInteger,    ///< integer_plan
  kRule,       ///< generate_plan, the baseline: chooses the strength itself
};

/// A plan that is to be made.
struct PlanRequest {
  PlanSettings settings;
  PlanMethod method = PlanMethod::kAnnealing;
  /// of each seed; none: `scene_u` where the source has such seeds, else what is customary for it, with a note
  std::optional<double> strength_u;
  double scene_u = 0.5;
  /// What the plan has to reach, those of stage "plan": constraints of the annealing; none: default_dose_goals(), which
  /// its standard objective keeps.
  std::vector<DoseGoal> goals;
  /// Its strength is set from the above; so is the number of seeds, where it has none: 90 up to 50 cc, or as many as
  /// make up the customary strength.
  OptimiserSettings how;
  Margins margins;  ///< around the gland: what is planned for, and judged, is the gland with them
  /// Fewer needles are tried until a goal is missed, by halving, some seconds each; a note says what was missed then.
  bool fewest_needles = false;
  /// kInteger: text of a linear programme in CPLEX's LP format to the solver's text of its solution.
  std::function<std::string(const std::string& programme)> solve;
};

/// A plan that was made, and what had to be assumed for it: every note goes into the plan's file, report and JSON.
struct MadePlan {
  Plan plan;
  std::vector<std::string> notes;
  std::vector<Structure> structures;  ///< with what was assumed, and the gland with its margins as "target"
};

/// Makes a plan that load_plan accepts, or refuses with PlanRefused: a strength in which the source's seeds are not
/// made; a gland that the template or the needles do not reach, that needs more seeds than the scene allows, or of
/// which the best plan found covers less than the goals ask for (V100 of the prostate; 90 % where they ask for none):
/// too few seeds or needles, the pubic arch, the urethra's clearance. Other UserErrors as optimise_plan and
/// generate_plan. Deterministic. Not real-time.
MadePlan make_plan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                   const PlanRequest& request, const std::function<void(double share)>& progress = {});

}  // namespace brachy
