#pragma once

#include <span>
#include <string>
#include <vector>

#include "apps/score/spread.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/seeds/seed.h"

namespace brachy {

/// Distance of a seed from its planned position, mm: total² = axial² + lateral².
struct Misplacement {
  double total_mm = 0;
  double axial_mm = 0;    ///< along the planned needle; > 0: too deep, < 0: left behind
  double lateral_mm = 0;  ///< across it, ≥ 0
};

Misplacement misplacement(const PlannedSeed& planned, const Vec3& position);

/// A planned seed and its errors.
struct SeedScore {
  Seed seed;
  PlannedSeed planned;
  std::string hole;  ///< of its planned needle
  Misplacement dropped, rest;
};

/// Over the planned seeds that were dropped.
struct MisplacementSpread {
  Spread total_mm, axial_mm, lateral_mm;    ///< axial: of its size
  double mean_signed_axial_mm = kNoNumber;  ///< > 0: too deep on the whole
  double axial_share = kNoNumber;           ///< mean size of the axial part over the mean of the whole
};

struct SeedsScore {
  std::vector<SeedScore> planned;    ///< in the order of falling
  std::vector<Seed> unplanned;       ///< fell and are not in the plan, in the order of falling
  std::vector<std::size_t> missing;  ///< in the plan and did not fall: indices in Plan::seeds
  MisplacementSpread dropped, rest;  ///< where they fell; where they are once the needles are out
  Spread gland_motion_mm;            ///< size of Seed::gland_motion, of all that fell
};

/// Matches by Seed::planned. Throws UserError where that is not in the plan: the seeds are another's.
SeedsScore score_seeds(const Plan& plan, const TemplateGrid& grid, std::span<const Seed> seeds);

}  // namespace brachy
