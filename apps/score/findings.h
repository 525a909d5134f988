#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/score/consequences.h"
#include "apps/score/goal_results.h"
#include "apps/score/needle_score.h"
#include "apps/score/structure_contact.h"
#include "core/brachytherapy/plan/plan.h"

namespace brachy {

struct Score;
class SurfaceBvh;

/// A mistake in a session, or what the tissue did to it.
struct Finding {
  std::string text;   ///< one sentence for the instructor, with what the mistake cost
  std::string cause;  ///< "depth"; the list is in cause_text.cpp and findings.cpp
  double weight = 0;  ///< how much it matters beside its dose: misplaced seeds times mm, or the like
  double harm_percent =
      0;  ///< DoseChange::harm_percent of `cost`; 0: less than what an implant as planned varies by
  bool is_of_organ = false;               ///< a needle was where it should not be: first, whatever the dose
  std::vector<std::size_t> needles = {};  ///< members, in Plan::needles; empty: none, or all
  std::vector<std::size_t> seeds = {};    ///< the seeds that it moved or kept back, in Plan::seeds
  /// Where to look in the session, s, on the recording's clock: when the first of its seeds fell, or, of seeds that are
  /// missing, the last that came from their needle; when an organ was entered, or the needle that should not have been.
  /// None: it is of no moment.
  std::optional<double> at_s = std::nullopt;
  /// The implant as it is, against the same without this cause: seeds are where they would be if the other causes alone
  /// had acted. None: it did nothing to the dose.
  std::optional<DoseChange> cost = std::nullopt;
};

/// What no cause explains.
struct Unexplained {
  DoseChange change;                   ///< the implant without all causes, against the plan
  double mean_mm = 0, largest_mm = 0;  ///< distance of its seeds from the planned ones
};

struct Findings {
  std::vector<Finding> all;
  std::optional<Unexplained> unexplained;  ///< none: the dropped seeds are not known
};

// What went wrong whatever was implanted.

/// Organs that a tip entered, each once, and bone that stopped one.
std::vector<Finding> organ_findings(const std::vector<StructureContact>& contacts);
/// Tips that moved too fast.
std::vector<Finding> hasty_findings(const NeedlesScore& needles);
/// Goals that the plan meets and the implant misses, in one: they are no mistake, and no single mistake's.
std::vector<Finding> missed_goal_findings(const std::vector<GoalResult>& goals, const DoseScore& dose);

/// What went wrong; nothing of a session as planned. The seeds' deviation is taken apart into causes (explanation.h),
/// as they fell and from there to where they rest; seeds that are missing, lost or in no plan are causes, too. Organs
/// entered come first, then what harmed the dose, the most harmful first, then the rest by weight: seeds times mm, a
/// missing seed by SeedAssignment::kFarthestMm, a puncture too many like half a seed. Goals that the plan meets and
/// the implant misses stand by themselves at the end; doubts about the plan's source, strength and prescription
/// (entry_doubts) before everything. `costs`: of the score's implant; null where its seeds are not known. `gland`:
/// the prostate at rest.
Findings find_mistakes(const Score& score, const Plan& plan, const TemplateGrid& grid,
                       const NeedleCosts* costs, const SurfaceBvh& gland);

}  // namespace brachy
