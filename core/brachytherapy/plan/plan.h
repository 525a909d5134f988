#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/brachytherapy/dose/dose_seed.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/plan/template_grid.h"

namespace brachy {

/// One needle of a plan.
struct PlanNeedle {
  // Lengths: seeds and spacers come in steps of 10 mm.
  static constexpr double kSeedMm = kSeedLengthMm, kSpacerMm = 5.5;

  std::string hole;          ///< of the template, "D4"
  double retraction_mm = 0;  ///< how far short of the base plane its tip stops, ≥ 0
  std::string train;         ///< from the tip backwards: s a seed, - a spacer; "s-s--s"

  /// Each seed's centre behind the needle's tip, mm, in the train's order.
  std::vector<double> seed_offsets_mm() const;
  double train_length_mm() const;

  bool operator==(const PlanNeedle&) const = default;
};

/// A planned seed: a DoseSeed and its position in the plan.
struct PlannedSeed : DoseSeed {
  std::size_t needle = 0;  ///< index in Plan::needles
  double offset_mm = 0;    ///< its centre behind the needle's tip
};

/// Needles, their holes and depths, and the seeds that each leaves.
struct Plan {
  std::string name;
  SourceModel source = SourceModel::kAmersham6711;
  double air_kerma_strength_u = 0.5;  ///< of each seed
  double prescription_gy = 145;
  double base_plane_mm = 0;  ///< from the template's plane along the needles to the base plane
  std::vector<PlanNeedle> needles;

  /// mm, world. Throws UserError where the needle's hole is not in the grid.
  Vec3 planned_tip(const TemplateGrid& grid, std::size_t needle) const;
  /// All of them, needle by needle in order, in each from the tip backwards: a seed's index here is its number in the
  /// plan. Axes are +z. Throws as planned_tip.
  std::vector<PlannedSeed> seeds(const TemplateGrid& grid) const;
  std::size_t seed_count() const;

  bool operator==(const Plan&) const = default;
};

}  // namespace brachy
