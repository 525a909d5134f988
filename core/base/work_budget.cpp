#include "core/base/work_budget.h"

namespace brachy {
namespace {

constexpr WorkCosts kStored;

/// A count of the stored table, on a machine that may do `share` of it.
template <class Count>
Count share_of(Count count, double share) {
  return std::max(Count{1}, static_cast<Count>(static_cast<double>(count) * share));
}

}  // namespace

WorkCosts WorkCosts::slower_by(double factor) const {
  return {factor * system_s, factor * landmark_s,         factor * landmark_pair_s,
          factor * step_s,   factor * certificate_pair_s, block_ring_steps_per_s / factor};
}

Allowance WorkBudget::allowance(const TickWork& work) const noexcept {
  // What this machine may do of a count at the stored costs.
  const double search_share = kStored.certificate_pair_s / costs.certificate_pair_s;
  const double ring_share = costs.block_ring_steps_per_s / kStored.block_ring_steps_per_s;
  const auto by_search = [&](auto count) { return share_of(count, search_share); };
  const auto by_rings = [&](std::size_t count) { return share_of(count, ring_share); };
  const auto pairs_in = [&](double time_s) {
    return static_cast<std::uint64_t>(std::max(0.0, time_s) / costs.certificate_pair_s);
  };
  const std::size_t sources = std::max<std::size_t>(1, work.sources), in_steps = work.steps * work.sources;
  Allowance may;

  // Forces and field in one tick.
  may.may_find_field = is_whole || work.landmarks <= few_field_landmarks || time_left(work_share, work) > 0;
  may.puts_resting_needles_first = work.needles > few_needles;

  // The field near what moves.
  const bool has_many_landmarks = work.landmarks > few_corrected_landmarks;
  may.steps = std::max<std::size_t>(1, by_rings(step_rings) / sources);
  may.may_add_step = in_steps <= by_rings(most_step_rings);
  may.may_correct_steps = work.sources <= by_rings(corrected_rings);
  may.correction_reach = has_many_landmarks ? short_correction_reach : correction_reach;
  may.may_renew_corrections = !has_many_landmarks;
  may.correction_sweeps = correction_sweeps;

  // The certificate. Once a part of the tick's field is left undecided so is the tick.
  const std::size_t block_cost =
      WorkCosts::kBlockRings + WorkCosts::kStepRings * work.steps + work.step_sources;
  const double blocks_s = static_cast<double>(work.blocks * block_cost) / costs.block_ring_steps_per_s;
  const std::uint64_t beside_blocks =
      work.blocks == 0 ? by_search(tick_pairs) : pairs_in(time_left(whole_share, work) - blocks_s);
  const std::uint64_t in_tick = by_search(tick_pairs);
  const std::uint64_t spent = std::min(in_tick, work.certificate_pairs), left = in_tick - spent;
  may.may_certify =
      !work.is_undecided && !(work.reaches_everywhere && work.sources > by_search(certified_sources));
  const std::uint64_t in_search =
      std::max(by_search(fold_pairs), std::min(by_search(search_pairs), beside_blocks));
  may.certificate_pairs = std::min(may.may_certify ? in_search : by_search(fold_pairs), left);
  may.margin_pairs = std::min(by_search(margin_pairs), may.certificate_pairs);
  may.resting_pairs = pairs_in(time_left(rest_share, work));
  may.step_tries = beside_blocks < step_tries * by_search(search_pairs) ? 1 : step_tries;
  const bool has_few_sources = work.sources <= few_candidate_sources;
  may.candidate_stride = 1 + work.sources / candidates;
  may.strongest_candidates = has_few_sources ? 0 : strongest_candidates;
  may.may_sum_single_rings = has_few_sources;
  may.close_stride = 1 + in_steps / by_rings(close_step_rings);
  may.refined_blocks = std::clamp(by_rings(refined_step_rings) / std::max<std::size_t>(1, in_steps),
                                  std::size_t{1}, kRefinedBlocks);
  may.weakest_steps = in_steps > by_rings(weakest_step_rings) ? 1 : work.steps;

  // The far field: what is left of the period.
  const auto blocks_in = [&](double time_s) {
    return static_cast<std::size_t>(std::max(0.0, costs.block_ring_steps_per_s * time_s)) / block_cost;
  };
  TickWork with_search = work;
  with_search.certificate_pairs = spent;
  const std::size_t least = work.blocks / least_blocks_share;
  may.easy_blocks = is_whole ? work.blocks : std::max(least, blocks_in(time_left(light_share, with_search)));
  const auto besides_lags = [&](double share) {
    const std::size_t most = blocks_in(time_left(share, with_search)),
                      lags = work.blocks / WorkCosts::kLagBlocks;
    return most - std::min(most, lags);
  };
  may.blocks = std::max(may.easy_blocks, besides_lags(work_share));
  may.whole_blocks = besides_lags(whole_share);
  may.lag_mm = lag_mm;
  return may;
}

// Of that share of the period, besides blocks; below 0 where it does not do.
double WorkBudget::time_left(double share, const TickWork& work) const noexcept {
  const auto landmarks = static_cast<double>(work.landmarks);
  return share * period_s - costs.system_s - costs.landmark_s * landmarks -
         costs.landmark_pair_s * landmarks * landmarks - costs.step_s * static_cast<double>(work.steps) -
         costs.certificate_pair_s * static_cast<double>(work.certificate_pairs);
}

}  // namespace brachy
