#include "core/brachytherapy/plan/change/plan_ledger.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/brachytherapy/plan/plan_check.h"
#include "core/brachytherapy/seeds/remaining_seeds.h"

namespace brachy {
namespace {

constexpr double kSameDepthMm = 1e-6;  // what a plan file's base plane and retraction round off

double depth_in(const Plan& plan, const PlanNeedle& needle) {
  return plan.base_plane_mm - needle.retraction_mm;
}

}  // namespace

PlanLedger::PlanLedger(Plan plan, const TemplateGrid& grid, double needle_length_mm)
    : all_(std::move(plan)),
      grid_(grid),
      needle_length_mm_(needle_length_mm),
      withdrawn_(all_.needles.size(), 0) {
  count_seeds();
}

void PlanLedger::count_seeds() {
  needle_of_.clear();
  for (std::size_t n = 0; n < all_.needles.size(); ++n)
    needle_of_.insert(needle_of_.end(), all_.needles[n].seed_offsets_mm().size(), n);
}

double PlanLedger::depth_mm(std::size_t needle) const {
  return depth_in(all_, all_.needles[needle]);
}

std::vector<char> PlanLedger::begun(std::span<const Seed> fallen, std::span<const std::int32_t> lost) const {
  std::vector<char> is_begun(all_.needles.size(), 0);
  const auto take = [&](std::int32_t seed) {
    if (seed >= 0 && static_cast<std::size_t>(seed) < needle_of_.size())
      is_begun[needle_of_[static_cast<std::size_t>(seed)]] = 1;
  };
  for (const Seed& seed : fallen) take(seed.planned);
  for (const std::int32_t seed : lost) take(seed);
  return is_begun;
}

std::vector<DoseSeed> PlanLedger::placed(std::span<const Seed> fallen,
                                         std::span<const std::int32_t> lost) const {
  std::vector<DoseSeed> all;
  for (const Seed& seed : fallen) all.push_back(seed.at_rest());
  const std::vector<char> is_begun = begun(fallen, lost);
  for (const PlannedSeed& seed : remaining_seeds(all_.seeds(grid_), fallen, lost))
    if (is_begun[seed.needle] && !withdrawn_[seed.needle]) all.push_back(seed);
  return all;
}

Plan PlanLedger::plan_of(const std::vector<std::size_t>& needles) const {
  Plan plan = all_;
  plan.needles.clear();
  for (const std::size_t n : needles) plan.base_plane_mm = std::max(plan.base_plane_mm, depth_mm(n));
  for (const std::size_t n : needles) {
    PlanNeedle needle = all_.needles[n];
    needle.retraction_mm = plan.base_plane_mm - depth_mm(n);
    plan.needles.push_back(std::move(needle));
  }
  return plan;
}

Plan PlanLedger::rest(const std::vector<char>& begun) const {
  std::vector<std::size_t> needles;
  for (std::size_t n = 0; n < all_.needles.size(); ++n)
    if (!withdrawn_[n] && !begun[n]) needles.push_back(n);
  return plan_of(needles);
}

Plan PlanLedger::in_use() const {
  return rest(std::vector<char>(all_.needles.size(), 0));
}

Plan PlanLedger::with_rest(const std::vector<char>& begun, const Plan& rest) const {
  std::vector<std::size_t> kept;
  for (std::size_t n = 0; n < all_.needles.size(); ++n)
    if (!withdrawn_[n] && begun[n]) kept.push_back(n);
  Plan whole = plan_of(kept);
  const double base_mm = whole.base_plane_mm;
  for (const PlanNeedle& needle : rest.needles)
    whole.base_plane_mm = std::max(whole.base_plane_mm, depth_in(rest, needle));
  for (PlanNeedle& needle : whole.needles) needle.retraction_mm += whole.base_plane_mm - base_mm;
  for (const PlanNeedle& given : rest.needles) {
    const std::string where = "hole " + one_short_line(given.hole) + ": ";
    const double depth = depth_in(rest, given);
    if (!(depth > 0))
      throw UserError(where + "its tip would be " + text_of(depth) +
                      " mm beyond the template; place it deeper");
    if (depth > needle_length_mm_)
      throw UserError(where + "its tip would be " + text_of(depth) +
                      " mm beyond the template, and the needle is " + text_of(needle_length_mm_) +
                      " mm long");
    for (std::size_t n = 0; n < kept.size(); ++n)
      if (grid_.position(given.hole) && grid_.position(given.hole) == grid_.position(whole.needles[n].hole))
        throw UserError(where + "a needle went through it and has left seeds; use another hole");
    PlanNeedle needle = given;
    needle.retraction_mm = whole.base_plane_mm - depth;
    whole.needles.push_back(std::move(needle));
    check_needle(whole, whole.needles.size() - 1, {grid_, needle_length_mm_},
                 [&](const char* key, const std::string& what) {
                   throw UserError(where + "its " + key + " " + what);
                 });
  }
  return whole;
}

void PlanLedger::change_to(const Plan& whole) {
  Plan all = all_;
  std::vector<char> withdrawn(all_.needles.size(), 1);
  const auto known = [&](const PlanNeedle& needle) -> std::optional<std::size_t> {
    std::optional<std::size_t> found;
    for (std::size_t n = 0; n < all_.needles.size(); ++n) {
      const PlanNeedle& other = all_.needles[n];
      if (withdrawn[n] && other.hole == needle.hole && other.train == needle.train &&
          std::abs(depth_mm(n) - depth_in(whole, needle)) <= kSameDepthMm && (!found || !withdrawn_[n]))
        found = n;
    }
    return found;
  };
  for (const PlanNeedle& needle : whole.needles) {
    if (const auto n = known(needle)) {
      withdrawn[*n] = 0;
      continue;
    }
    PlanNeedle added = needle;
    added.retraction_mm = all.base_plane_mm - depth_in(whole, needle);
    all.needles.push_back(std::move(added));
  }
  if (all.seed_count() > LoadingPlan::kMostSeeds)
    throw UserError("the plan has been changed too often: all its needles together would have " +
                    std::to_string(all.seed_count()) + " seeds, and at most " +
                    std::to_string(LoadingPlan::kMostSeeds) + " are counted; start another session");
  withdrawn.resize(all.needles.size(), 0);
  all_ = std::move(all);
  withdrawn_ = std::move(withdrawn);
  count_seeds();
  ++changes_;
}

}  // namespace brachy
