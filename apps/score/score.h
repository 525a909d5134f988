#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/score/dose_score.h"
#include "apps/score/needle_score.h"
#include "apps/score/recording.h"
#include "apps/score/seed_score.h"
#include "core/structures/structure.h"

namespace brachy {

/// What a session was judged to be, against its plan.
struct Score {
  std::string recording, plan;       ///< names
  std::vector<std::string> remarks;  ///< what could not be scored and why, a sentence each
  std::size_t planned_seeds = 0;
  std::optional<SeedsScore> seeds;  ///< nothing: not known what fell
  NeedlesScore needles;
  DoseScore dose;
};

/// Judges a recording. `structures`: the scene's at rest, the tissue's own surface ("prostate") first
/// (core/structures/load_structures.h). Throws UserError where the seeds are not of this plan or it does not fit the grid.
/// Deterministic; some tenths of a second, more for a recording of an hour: `progress`, if any, is told the share done.
Score score_session(const Plan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                    const DoseSettings& dose, const Recording& recording,
                    const std::function<void(double share)>& progress = {});

}  // namespace brachy
