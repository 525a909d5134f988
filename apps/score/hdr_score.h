#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "apps/score/axial_slices.h"
#include "apps/score/findings.h"
#include "core/brachytherapy/dose/dose_settings.h"
#include "core/brachytherapy/dose/dvh.h"
#include "core/brachytherapy/hdr/catheter_course.h"
#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// A planned catheter against the one that was delivered for it. mm.
struct CatheterScore {
  std::size_t planned = 0;                   ///< index in HdrPlan::catheters
  std::optional<std::uint32_t> needle = {};  ///< none: no needle lies at its hole
  Vec3 tip_error = Vec3::Zero();             ///< delivered − planned tip, world frame, as it lies now
  double mean_mm = 0,
         largest_mm = 0;  ///< distance of dwell positions from the planned ones, where the tissue is at rest
  double along_mm = 0, across_mm = 0;  ///< of tip_error, along +z and across it
  /// What its dwells add to each structure's mean, Gy, in the order of HdrScore::delivered, whose means are the sums
  /// over all catheters; alone they would give the same to 0.2 %. Empty: no needle lies there.
  std::vector<double> mean_gy = {};
};

/// A session of HDR against its plan.
struct HdrScore {
  /// A needle farther from a planned catheter than so many holes of the template is not it.
  static constexpr double kFarthestHoles = 3;

  std::vector<CatheterScore> catheters;  ///< of each planned one
  std::vector<std::uint32_t> unplanned;  ///< needles that belong to no planned catheter
  double prescription_gy = 0;
  std::vector<StructureDose> plan;         ///< planned positions and times
  std::vector<StructureDose> delivered;    ///< delivered positions, planned times
  std::vector<StructureDose> reoptimised;  ///< delivered positions, times optimised for them
  HdrPlan reoptimised_plan;                ///< its times; catheters that were not delivered have none
  std::vector<Vec3> dwells;                ///< delivered positions, where the tissue is at rest, mm
  std::vector<AxialSlice> slices;          ///< with the dose as delivered; empty: nothing was
  std::vector<Finding> findings;           ///< what went wrong, the most harmful first
};

/// Each planned catheter's course of `catheters`, as score_hdr says; null: none.
std::vector<const CatheterCourse*> assign_catheters(const HdrPlan& plan, const TemplateGrid& grid,
                                                    const std::vector<CatheterCourse>& catheters);
/// The planned times where the catheters' tissue is at rest, planned catheter by catheter.
std::vector<Dwell> delivered_dwells(const HdrPlan& plan, const std::vector<const CatheterCourse*>& courses);

/// Needles belong to planned catheters by position, whatever their numbers: each to one, so that the sum of squared
/// distances at the template is least, no farther than HdrScore::kFarthestHoles; where all are shifted alike by up to
/// as much, the distances without that shift, if they are less by more than it would win by chance (the Bayesian
/// information criterion, for two parameters and a scatter of 1.5 mm). A channel gives its planned times
/// where its catheter lies. Dose is that of the structures at rest, with dwell positions where their tissue is at
/// rest: that is what each piece of tissue gets. Deterministic; some seconds.
HdrScore score_hdr(const HdrPlan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                   DoseSettings dose, const std::vector<CatheterCourse>& catheters);

}  // namespace brachy
