#include "apps/score/score.h"

#include <cassert>
#include <optional>
#include <utility>

#include "core/geometry/surface/surface_bvh.h"

namespace brachy {
namespace {

constexpr double kSharePoses = 0.9;  // of a long recording's time; the rest is dose

/// The seeds of a session by who put them there.
struct SeedsByOrigin {
  std::vector<Seed> at_start, fallen;  ///< these in the order of falling
};

/// Of a file of seeds alone all are the implant that is scored. One of which only the place is known is taken for the
/// planned one that it lies at.
SeedsByOrigin by_origin(const Recording& recording, const Plan& plan, const TemplateGrid& grid) {
  SeedsByOrigin seeds;
  if (!recording.seeds) return seeds;
  for (const Seed& seed : *recording.seeds)
    (seed.was_there() && !recording.is_of_seeds_alone ? seeds.at_start : seeds.fallen).push_back(seed);
  if (recording.is_of_seeds_alone && plan.seed_count() > 0)
    for (const SeedScore& at : score_seeds(plan, grid, seeds.fallen).by_position.placed)
      if (at.seed.was_there())
        seeds.fallen[at.seed.id - 1].planned = static_cast<std::int32_t>(at.planned_index);
  return seeds;
}

}  // namespace

std::string seeds_without_plan(const Score& score) {
  if (score.seeds || score.dose.rest.structures.empty()) return {};
  return std::to_string(score.dose.rest.seeds) + " in the body, and no plan to compare them with";
}

Score score_session(const Plan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                    const DoseSettings& dose, const Recording& recording,
                    const std::function<void(double share)>& progress, const std::vector<DoseGoal>& goals) {
  assert(!structures.empty());
  Score score;
  score.recording = recording.name;
  score.plan = plan.name;
  score.remarks = recording.remarks;
  score.planned_seeds = plan.seed_count();
  const SeedsByOrigin seeds = by_origin(recording, plan, grid);
  const bool has_plan = plan.seed_count() > 0 || !recording.is_of_seeds_alone;
  if (!has_plan) score.remarks.push_back("There is no plan: what was meant is not known.");
  if (recording.seeds && has_plan) {
    score.seeds = score_seeds(plan, grid, seeds.fallen);
    score.trains = train_drops(*score.seeds, plan.needles.size());
    score.unpunctured = unpunctured_needles(*score.seeds, recording.forces);
  }
  const SurfaceBvh tissue(structures.front().mesh);
  std::size_t poses = 1, looked_at = 0;
  if (recording.poses)
    for (const auto& needle : recording.poses->needles()) poses += needle.motion.samples().size();
  score.needles =
      score_needles(holes_of(plan.needles), grid, recording.poses ? &*recording.poses : nullptr,
                    recording.forces, [&](const Vec3& p) {
                      if (progress)
                        progress(kSharePoses * static_cast<double>(looked_at++) / static_cast<double>(poses));
                      return tissue.inside(p);
                    });
  if (progress) progress(kSharePoses);
  DoseSettings of_plan = dose;
  of_plan.prescription_gy = plan.prescription_gy;
  ImplantDose implant(structures, of_plan);
  score.dose = score_dose(implant, plan, grid, recording.seeds ? &*recording.seeds : nullptr, seeds.at_start);
  const auto organs = std::span(structures).subspan(1);
  if (recording.passes)
    score.contacts =
        structure_contacts(organs, grid, *recording.passes, recording.poses ? &*recording.poses : nullptr);
  else if (recording.poses)
    score.contacts = structure_contacts(organs, grid, *recording.poses);
  if (!has_plan) score.dose.plan = {};
  score.failed_drops = recording.failed_drops;
  score.goals = judge(goals, score.dose);
  std::optional<NeedleCosts> costs;
  if (recording.seeds && has_plan) {
    costs.emplace(plan, grid, implant, seeds.fallen);
    score.consequences = find_consequences(*costs, plan, implant, score.dose.plan.structures);
  }
  if (recording.seeds) score.slices = axial_slices(structures, implant.grid(), plan.prescription_gy);
  for (const RecordedStudy& study : recording.studies)
    score.studies.push_back({study.t_s, score_study(study.study)});
  // A session of outlining alone has no implant to find fault with, and seeds without a plan are not wrong.
  if (!has_plan) return score;
  if (score.studies.empty() || !recording.seeds || !seeds.fallen.empty()) {
    Findings found = find_mistakes(score, plan, grid, costs ? &*costs : nullptr, tissue);
    score.findings = std::move(found.all);
    score.unexplained = found.unexplained;
  }
  return score;
}

}  // namespace brachy
