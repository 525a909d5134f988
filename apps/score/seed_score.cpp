#include "apps/score/seed_score.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/score/seed_assignment.h"
#include "core/base/error.h"

namespace brachy {
namespace {

SeedScore score_of(const Plan& plan, const std::vector<PlannedSeed>& planned, const Seed& seed,
                   std::size_t index) {
  const PlannedSeed& to = planned[index];
  return {seed,
          to,
          index,
          plan.needles[to.needle].hole,
          misplacement(to, seed.dropped),
          misplacement(to, seed.rest)};
}

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

// Sums of distances along one line are often the same for several assignments: of these the one without a large
// distance is preferred, by a share of the square too small to count otherwise.
constexpr double kPreferEven = 1e-6;  // 1/mm

SeedAssignment assign(const Plan& plan, const std::vector<PlannedSeed>& planned,
                      std::span<const Seed> seeds) {
  const auto columns =
      cheapest_assignment(seeds.size(), planned.size(),
                          SeedAssignment::kFarthestMm * (1 + kPreferEven * SeedAssignment::kFarthestMm),
                          [&](std::size_t seed, std::size_t column) {
                            const double distance = (seeds[seed].rest - planned[column].position).norm();
                            return distance * (1 + kPreferEven * distance);
                          });
  SeedAssignment assignment;
  std::vector<bool> is_placed(planned.size(), false);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    if (const auto column = columns[i]) {
      is_placed[*column] = true;
      assignment.placed.push_back(score_of(plan, planned, seeds[i], *column));
    } else {
      assignment.extra.push_back(seeds[i]);
    }
  }
  for (std::size_t i = 0; i < planned.size(); ++i)
    if (!is_placed[i]) assignment.missing.push_back(i);
  assignment.dropped = spread_over(assignment.placed, &SeedScore::dropped);
  assignment.rest = spread_over(assignment.placed, &SeedScore::rest);
  return assignment;
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
    score.planned.push_back(score_of(plan, planned, seed, i));
  }
  for (std::size_t i = 0; i < planned.size(); ++i)
    if (!fell[i]) score.missing.push_back(i);
  score.dropped = spread_over(score.planned, &SeedScore::dropped);
  score.rest = spread_over(score.planned, &SeedScore::rest);
  score.gland_motion_mm = spread_of(motions);
  score.by_position = assign(plan, planned, seeds);
  return score;
}

std::string headline(const SeedsScore& score) {
  const SeedAssignment& a = score.by_position;
  std::string text = fmt::format("{} of {} placed, {} missing, {} extra", a.placed.size(),
                                 a.placed.size() + a.missing.size(), a.missing.size(), a.extra.size());
  if (!a.placed.empty()) text += fmt::format("; placed ones {:.1f} mm mean", a.rest.total_mm.mean);
  return text;
}

}  // namespace brachy
