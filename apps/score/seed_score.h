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
  std::size_t planned_index = 0;  ///< in Plan::seeds
  std::string hole;               ///< of its planned needle
  Misplacement dropped, rest;
};

/// Over the planned seeds that were dropped.
struct MisplacementSpread {
  Spread total_mm, axial_mm, lateral_mm;    ///< axial: of its size
  double mean_signed_axial_mm = kNoNumber;  ///< > 0: too deep on the whole
  double axial_share = kNoNumber;           ///< mean size of the axial part over the mean of the whole
};

/// The seeds that fell, matched with the planned ones by where they are at rest, whatever needle they came from: the
/// sum of distances is least, each unmatched seed counting as kFarthestMm (cheapest_assignment).
struct SeedAssignment {
  /// A pair further apart is an extra seed and a missing one: a seed and two spacers, nearly the distance to the next
  /// seed of a common train, and two holes of the template.
  static constexpr double kFarthestMm = 10;

  std::vector<SeedScore> placed;     ///< in the order of falling
  std::vector<Seed> extra;           ///< near no planned seed that is not taken, in the order of falling
  std::vector<std::size_t> missing;  ///< indices in Plan::seeds that no seed lies near
  MisplacementSpread dropped, rest;  ///< of the placed ones
};

/// Who is compared with whom is told apart: `planned`, `unplanned` and `missing` go by the seed's number in the plan
/// that its needle was loaded with (Seed::planned), `by_position` by where it lies.
struct SeedsScore {
  std::vector<SeedScore> planned;    ///< in the order of falling
  std::vector<Seed> unplanned;       ///< fell and are not in the plan, in the order of falling
  std::vector<std::size_t> missing;  ///< in the plan and did not fall: indices in Plan::seeds
  MisplacementSpread dropped, rest;  ///< where they fell; where they are once the needles are out
  Spread gland_motion_mm;            ///< size of Seed::gland_motion, of all that fell
  SeedAssignment by_position;
};

/// Throws UserError where Seed::planned is not in the plan: the seeds are another's.
SeedsScore score_seeds(const Plan& plan, const TemplateGrid& grid, std::span<const Seed> seeds);

/// "71 of 75 placed, 4 missing, 2 extra; placed ones 0.4 mm mean": of SeedsScore::by_position.
std::string headline(const SeedsScore& score);

}  // namespace brachy
