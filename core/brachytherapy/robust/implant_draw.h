#pragma once

#include <cstdint>
#include <vector>

#include "core/brachytherapy/dose/dose_seed.h"
#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/robust/uncertainty.h"

namespace brachy {

/// A plan's sources of dose, as it has them: seeds, or dwells as seeds of the same dose (as_seeds).
struct PlannedSources {
  struct Source {
    DoseSeed seed;
    std::size_t needle = 0;
    double seconds = 0;  ///< of a dwell; 0: a seed that stays
  };
  std::vector<Source> sources;
  double prescription_gy = 0;

  static PlannedSources of(const Plan& plan, const TemplateGrid& grid);     ///< throws as Plan::seeds
  static PlannedSources of(const HdrPlan& plan, const TemplateGrid& grid);  ///< throws as HdrPlan::dwells
};

/// One treatment by the plan: where its sources are, and how the patient differs from what the plan was made for.
struct ImplantDraw {
  std::vector<DoseSeed> seeds;  ///< in the frame of the gland, which stays; all errors of strength in theirs
  double gland_outline_mm = 0, urethra_outline_mm = 0, organ_outline_mm = 0;  ///< surfaces, outwards
  Vec3 organs_moved_mm = Vec3::Zero();  ///< what is not gland or urethra, against them
  double stretch = 1;                   ///< of the gland and the urethra, about the gland's middle
};

/// Draw number `number` of those that `random_seed` stands for: the same for all plans with as many needles and
/// sources, whatever other draws are made. `middle` of the gland's box, mm. Deterministic.
ImplantDraw draw_implant(const PlannedSources& plan, const Vec3& middle, const UncertaintySettings& settings,
                         const SeedMisplacement& misplacement, std::uint64_t random_seed,
                         std::uint64_t number);

}  // namespace brachy
