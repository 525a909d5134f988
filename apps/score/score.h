#pragma once

#include <algorithm>
#include <functional>
#include <optional>
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

/// Catheters of a fraction against their plan. mm.
struct CathetersScore {
  std::size_t placed = 0, missing = 0;  ///< planned ones
  std::size_t unplanned = 0;
  /// Of their dwell positions from the planned ones, where the tissue is at rest; kNoNumber: none is placed.
  double mean_mm = kNoNumber, largest_mm = kNoNumber;
  double depth_mm = kNoNumber;  ///< the largest size of a tip's error along its catheter
};

/// One bound of an exercise and what became of it.
struct BoundResult {
  std::string text;  ///< "mean error 0.4 mm, at most 2"
  bool is_kept = false;
};

/// Whether a session passes its exercise.
struct ExerciseResult {
  std::string name;  ///< the exercise's
  std::vector<BoundResult> bounds;
  bool has_passed() const { return std::ranges::all_of(bounds, &BoundResult::is_kept); }
};

/// Whose session it was, when and of what, as session.json has it; empty: not known.
struct SessionAbout {
  std::string trainee, exercise;
  std::string began;  ///< UTC
};

/// The score of a session against its plan.
struct Score {
  std::string recording, plan;  ///< names
  SessionAbout about;
  std::optional<ExerciseResult>
      exercise;                      ///< of the session's exercise; none: it is of none, as far as is known
  std::vector<std::string> remarks;  ///< what could not be scored and the reason, a sentence each
  std::size_t planned_seeds = 0;
  std::optional<SeedsScore> seeds;          ///< none: the dropped seeds are not known
  std::optional<CathetersScore> catheters;  ///< of a fraction of HDR, which has no seeds
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

/// "51 in the body, and no plan to compare them with": of a file of seeds alone; empty where there is a plan.
std::string seeds_without_plan(const Score& score);

/// Scores a recording; the implant is judged by `goals`. `structures`: the scene's at rest, the tissue's own
/// surface ("prostate") first
/// (core/scene/load_structures.h). Throws UserError where the seeds are not of this plan or it does not fit the grid.
/// Deterministic; some tenths of a second, more for a recording of an hour: `progress`, if any, gets the share done.
Score score_session(const Plan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                    const DoseSettings& dose, const Recording& recording,
                    const std::function<void(double share)>& progress = {},
                    const std::vector<DoseGoal>& goals = default_dose_goals());

}  // namespace brachy
