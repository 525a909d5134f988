#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/plan/template_grid.h"
#include "core/brachytherapy/seeds/loading_plan.h"
#include "core/brachytherapy/seeds/seed.h"

namespace brachy {

/// A plan that changes while it is carried out. Needles and seeds keep their numbers: a change withdraws needles
/// and appends others, so that Seed::planned and the score against the plan at the start stay true. Needles that
/// were begun stay. A change is a whole plan, so that the ledger can be made again from the plan at the start and
/// the files of its changes (apps/session/plan_change_log.h).
/// Threads: one.
class PlanLedger {
 public:
  /// `plan`: the one at the start, checked against the grid and the needles' length
  /// (core/brachytherapy/plan/plan_file.h).
  PlanLedger(Plan plan, const TemplateGrid& grid, double needle_length_mm);

  /// Every needle that was ever planned, by number. Its retractions may be negative: later needles may go deeper than
  /// the base plane of the plan at the start, which stays.
  const Plan& all() const { return all_; }
  bool is_withdrawn(std::size_t needle) const { return withdrawn_[needle] != 0; }
  double depth_mm(std::size_t needle) const;  ///< of its planned tip beyond the template
  std::size_t changes() const { return changes_; }
  LoadingPlan loading() const { return LoadingPlan(all_, grid_, withdrawn_); }

  /// What has left its needle: by number of the planned needle, 1 where one of its seeds is in `fallen` or `lost`
  /// (seeds' numbers). As much work as they are.
  std::vector<char> begun(std::span<const Seed> fallen, std::span<const std::int32_t> lost) const;
  /// What lies in the body for certain: what has fallen, at rest, and the seeds still in needles that were begun.
  std::vector<DoseSeed> placed(std::span<const Seed> fallen, std::span<const std::int32_t> lost) const;
  /// The needles in use that were not begun, as a plan.
  Plan rest(const std::vector<char>& begun) const;
  /// All needles in use, as a plan that could be written to a file.
  Plan in_use() const;

  /// The plan in use with `rest` for the needles that were not begun. Errors: UserError in the words of an operator
  /// ("hole Z9: …"): a hole that the template does not have, or that is used twice or by a needle that was begun, a
  /// train with other letters than s and -, or without a seed, a tip out of reach.
  Plan with_rest(const std::vector<char>& begun, const Plan& rest) const;
  /// Puts `whole`, of with_rest() or in_use(), in the place of the plan in use. Needles that have the hole, depth and
  /// train of one known keep its number. Errors: UserError where the ledger would have more seeds than
  /// LoadingPlan::kMostSeeds; then it is as it was.
  void change_to(const Plan& whole);

 private:
  /// The plan of those needles, with the base plane where the deepest one of all is, or where it was.
  Plan plan_of(const std::vector<std::size_t>& needles) const;

  void count_seeds();

  Plan all_;
  std::vector<std::size_t> needle_of_;  // of each seed
  TemplateGrid grid_;
  double needle_length_mm_;
  std::vector<char> withdrawn_;  // by needle
  std::size_t changes_ = 0;
};

}  // namespace brachy
