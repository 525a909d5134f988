#include "apps/score/score.h"

#include <cassert>

#include "core/surface/surface_bvh.h"

namespace brachy {

Score score_session(const Plan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                    const DoseSettings& dose, const Recording& recording) {
  assert(!structures.empty());
  Score score;
  score.recording = recording.name;
  score.plan = plan.name;
  score.remarks = recording.remarks;
  score.planned_seeds = plan.seed_count();
  if (recording.seeds) score.seeds = score_seeds(plan, grid, *recording.seeds);
  const SurfaceBvh tissue(structures.front().mesh);
  score.needles = score_needles(plan, grid, recording.poses ? &*recording.poses : nullptr, recording.forces,
                                [&](const Vec3& p) { return tissue.inside(p); });
  score.dose = score_dose(plan, grid, structures, dose, recording.seeds ? &*recording.seeds : nullptr);
  return score;
}

}  // namespace brachy
