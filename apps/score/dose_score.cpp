#include "apps/score/dose_score.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "apps/score/spread.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "core/simulation/body_settings.h"

namespace brachy {
namespace {

constexpr std::array kFigures = {DoseFigure{"prostate", "V100", "%", &StructureDose::v100_percent},
                                 DoseFigure{"prostate", "V150", "%", &StructureDose::v150_percent},
                                 DoseFigure{"prostate", "V200", "%", &StructureDose::v200_percent},
                                 DoseFigure{"prostate", "D90", "Gy", &StructureDose::d90_gy},
                                 DoseFigure{"urethra", "D30", "Gy", &StructureDose::d30_gy},
                                 DoseFigure{"urethra", "D10", "Gy", &StructureDose::d10_gy},
                                 DoseFigure{"rectum", "V100", "cm³", &StructureDose::v100_cc},
                                 DoseFigure{"rectum", "D2cc", "Gy", &StructureDose::d2cc_gy}};

template <class Seeds, class ToDose>
DoseStage stage_of(ImplantDose& dose, const Seeds& seeds, ToDose&& to_dose,
                   const Vec3& stretch = Vec3::Ones()) {
  dose.clear();
  for (const auto& seed : seeds) dose.add(to_dose(seed), stretch);
  return {seeds.size(), dose.evaluate()};
}

}  // namespace

DoseScore score_dose(const Plan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                     DoseSettings settings, const std::vector<Seed>* seeds) {
  settings.prescription_gy = plan.prescription_gy;
  ImplantDose dose(structures, settings);
  return score_dose(dose, plan, grid, seeds);
}

DoseScore score_dose(ImplantDose& dose, const Plan& plan, const TemplateGrid& grid,
                     const std::vector<Seed>* seeds, std::span<const Seed> at_start) {
  DoseScore score;
  score.prescription_gy = plan.prescription_gy;
  score.margin_mm = dose.settings().margin_mm;
  const std::vector<PlannedSeed> planned = plan.seeds(grid);
  std::vector<DoseSeed> wanted = at_rest(at_start);
  wanted.insert(wanted.end(), planned.begin(), planned.end());
  score.plan = stage_of(dose, wanted, std::identity());
  if (!seeds) return score;
  score.dropped = stage_of(dose, *seeds, [](const Seed& s) { return s.as_dropped(); });
  const std::vector<DoseSeed> resting = at_rest(*seeds);
  score.day_zero = stage_of(dose, resting, std::identity(), SwellingSettings::kDayZero);
  std::erase_if(score.day_zero.structures,
                [](const StructureDose& s) { return s.name != "prostate" && s.name != "urethra"; });
  score.rest = stage_of(dose, resting, std::identity());
  return score;
}

std::span<const DoseFigure> dose_figures() {
  return kFigures;
}

double figure_of(const DoseStage& stage, const DoseFigure& figure) {
  const auto found = std::ranges::find(stage.structures, figure.structure, &StructureDose::name);
  return found == stage.structures.end() ? kNoNumber : (*found).*figure.value;
}

}  // namespace brachy
