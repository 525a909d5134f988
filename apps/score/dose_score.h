#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/seeds/seed.h"

namespace brachy {

/// Dose of some seeds to the structures at rest.
struct DoseStage {
  std::size_t seeds = 0;
  std::vector<StructureDose> structures;  ///< as ImplantDose has them; empty: not known
};

/// The same structures, at rest, under the planned seeds, under the dropped seeds where they fell (while the
/// needles held the gland away from rest), and under those where they are once all needles are out.
struct DoseScore {
  double prescription_gy = 0;  ///< the plan's
  double margin_mm = 0;  ///< of the dose grid around the prostate's bounding box; dose beyond is not known
  DoseStage plan, dropped, rest;
  /// What images of the day of the implant would state: the seeds at rest in a gland that is swollen as
  /// SwellingSettings::kDayZero has it, as if it stayed so. Of prostate and urethra, which swell. `rest` is what images
  /// of day 30 would (TG-137: Nath et al., Med. Phys. 36, 2009, 5310–5322, asks for that day).
  DoseStage day_zero;
};

/// `dose`: with the structures, and the plan's prescription; its seeds are removed, and afterwards it has those at
/// rest, or without `seeds` the plan's. `seeds` null: what was implanted is not known. `at_start`: those of them that
/// were there before, beside which the plan was to be.
DoseScore score_dose(ImplantDose& dose, const Plan& plan, const TemplateGrid& grid,
                     const std::vector<Seed>* seeds, std::span<const Seed> at_start = {});

/// `seeds` null: what was implanted is not known. `settings`: its prescription is the plan's instead.
DoseScore score_dose(const Plan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                     DoseSettings settings, const std::vector<Seed>* seeds);

/// A quality figure of the dose. What it should be, goals say (goal_results.h).
struct DoseFigure {
  const char* structure;  ///< whose
  const char* name;       ///< "V100"
  const char* unit;       ///< "%", "Gy", "cm³"
  double StructureDose::*value;
};

/// The figures of a session, in the order of reports.
std::span<const DoseFigure> dose_figures();

/// A stage's figure; kNoNumber where the scene has no such structure or its dose is not known.
double figure_of(const DoseStage& stage, const DoseFigure& figure);

}  // namespace brachy
