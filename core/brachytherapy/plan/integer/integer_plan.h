#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/plan/optimiser/optimise_plan.h"

namespace brachy {

/// The choice of needles and seeds as a mixed integer programme (as D'Souza, Meyer, Thomadsen, Ferris, Phys. Med. Biol.
/// 46, 2001, 805-814, and Lee, Zaider, INFORMS J. Appl. Anal. 33, 2003, have it), for comparison with the annealer:
///
///   minimise  Σ_p w⁻ u_p + w⁺ o_p + Σ_h n y_h + Σ s x_hk
///   where     D_p = Σ d_phk x_hk,  u_p ≥ least − D_p,  o_p ≥ D_p − most,  x_hk ≤ y_h,  Σ y_h ≤ needles,  Σ x ≤ seeds,
///
/// x and y 0 or 1. It is reduced so that a solver ends: a needle's seeds stand 10 mm apart from a fixed tip (one spacer
/// between them), and dose is watched at a few hundred points. A train with gaps is longer by up to 1 mm for each seed
/// that is left out; the plan that comes out is made of what trains can be, and judged by its own exact dose.
class IntegerProgramme {
 public:
  IntegerProgramme(const std::vector<Structure>& structures, const TemplateGrid& grid,
                   const PlanSettings& settings, const OptimiserSettings& how);

  /// In CPLEX's LP format.
  std::string text() const;
  /// The plan of a solution: lines "index name value reduced-cost" as CBC writes them, others skipped.
  /// Errors: UserError where no variable is 1.
  Plan plan_of(std::string_view solution) const;
  std::size_t binaries() const;  ///< how many variables are 0 or 1

 private:
  struct Slot {
    std::size_t choice;
    int row;
    std::vector<float> dose;  // at the points, shares of the prescription
  };
  struct Watched {
    double least, most, below, above;  // NaN: none
  };
  std::vector<NeedleChoice> choices_;
  std::vector<int> tips_;
  std::vector<Slot> slots_;
  std::vector<Watched> watched_;  // of each point
  std::size_t most_needles_, most_seeds_;
  double per_needle_, per_seed_;
  Plan plan_;  // without needles
};

/// The plan that `solve` finds: text in, solution out (IntegerProgramme).
Plan integer_plan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                  const PlanSettings& settings, const OptimiserSettings& how,
                  const std::function<std::string(const std::string&)>& solve);

}  // namespace brachy
