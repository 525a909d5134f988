#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/score/axial_slices.h"
#include "apps/score/consequences.h"
#include "apps/score/dose_score.h"
#include "apps/score/findings.h"
#include "apps/score/goal_results.h"
#include "apps/score/needle_score.h"
#include "apps/score/recording.h"
#include "apps/score/seed_score.h"
#include "apps/score/structure_contact.h"
#include "apps/score/train_drop.h"
#include "core/brachytherapy/contours/contour_score.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// The score of a session against its plan.
struct Score {
  std::string recording, plan;       ///< names
  std::vector<std::string> remarks;  ///< what could not be scored and the reason, a sentence each
  std::size_t planned_seeds = 0;
  std::optional<SeedsScore> seeds;  ///< none: the dropped seeds are not known
  NeedlesScore needles;
  DoseScore dose;
  /// Of all structures but the prostate; empty where no needle entered one, or the poses are not known.
  std::vector<StructureContact> contacts;
  std::optional<std::vector<FailedDrop>> failed_drops;  ///< lost and refused seeds; none: not known
  std::optional<Consequences> consequences;             ///< none: the dropped seeds are not known
  std::vector<GoalResult> goals;                        ///< of the plan and of the implant, in their order
  std::vector<AxialSlice> slices;  ///< with the dose of the seeds at rest; empty: not known
  /// Volume studies in their order; the last one counts in an exercise.
  struct Study {
    double t_s = 0;
    ContourScore score;
  };
  std::vector<Study> studies;
  std::vector<TrainDrop> trains;  ///< of needles that left two seeds or more
  std::vector<std::size_t>
      unpunctured;                ///< needles of the plan whose seeds fell and that only indented the capsule
  std::vector<Finding> findings;  ///< what went wrong, the heaviest first
  std::optional<Unexplained>
      unexplained;  ///< what no finding explains; none: the dropped seeds are not known
};

/// Scores a recording; the implant is judged by `goals`. `structures`: the scene's at rest, the tissue's own
/// surface ("prostate") first
/// (core/scene/load_structures.h). Throws UserError where the seeds are not of this plan or it does not fit the grid.
/// Deterministic; some tenths of a second, more for a recording of an hour: `progress`, if any, gets the share done.
Score score_session(const Plan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                    const DoseSettings& dose, const Recording& recording,
                    const std::function<void(double share)>& progress = {},
                    const std::vector<DoseGoal>& goals = default_dose_goals());

}  // namespace brachy
