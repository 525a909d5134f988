#include "apps/score/seed_score.h"

#include <algorithm>

#include "core/base/error.h"

namespace brachy {
namespace {

MisplacementSpread spread_over(const std::vector<SeedScore>& seeds, Misplacement SeedScore::*when) {
  std::vector<double> total, axial, lateral;
  double signed_axial = 0;
  for (const SeedScore& seed : seeds) {
    const Misplacement& m = seed.*when;
    total.push_back(m.total_mm);
    axial.push_back(std::abs(m.axial_mm));
    lateral.push_back(m.lateral_mm);
    signed_axial += m.axial_mm;
  }
  MisplacementSpread spread{spread_of(total), spread_of(axial), spread_of(lateral)};
  if (!seeds.empty()) spread.mean_signed_axial_mm = signed_axial / static_cast<double>(seeds.size());
  if (spread.total_mm.mean > 0) spread.axial_share = spread.axial_mm.mean / spread.total_mm.mean;
  return spread;
}

}  // namespace

Misplacement misplacement(const PlannedSeed& planned, const Vec3& position) {
  const Vec3 error = position - planned.position;
  const double axial = error.dot(planned.axis);
  return {error.norm(), axial, (error - axial * planned.axis).norm()};
}

SeedsScore score_seeds(const Plan& plan, const TemplateGrid& grid, std::span<const Seed> seeds) {
  const std::vector<PlannedSeed> planned = plan.seeds(grid);
  std::vector<bool> fell(planned.size(), false);
  SeedsScore score;
  std::vector<double> motions;
  for (const Seed& seed : seeds) {
    motions.push_back(seed.gland_motion.norm());
    if (seed.planned == Seed::kUnplanned) {
      score.unplanned.push_back(seed);
      continue;
    }
    const auto i = static_cast<std::size_t>(seed.planned);
    if (seed.planned < 0 || i >= planned.size())
      throw UserError("seed " + std::to_string(seed.id) + " is the plan's seed " +
                      std::to_string(seed.planned) + ", and the plan has " + std::to_string(planned.size()) +
                      " from 0 on; give the plan that the session was run with");
    fell[i] = true;
    score.planned.push_back({seed, planned[i], plan.needles[planned[i].needle].hole,
                             misplacement(planned[i], seed.dropped), misplacement(planned[i], seed.rest)});
  }
  for (std::size_t i = 0; i < planned.size(); ++i)
    if (!fell[i]) score.missing.push_back(i);
  score.dropped = spread_over(score.planned, &SeedScore::dropped);
  score.rest = spread_over(score.planned, &SeedScore::rest);
  score.gland_motion_mm = spread_of(motions);
  return score;
}

}  // namespace brachy
