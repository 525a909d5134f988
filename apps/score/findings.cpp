#include "apps/score/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <tuple>

#include "apps/score/cause_text.h"
#include "apps/score/explanation/explanation.h"
#include "apps/score/score.h"
#include "core/brachytherapy/plan/entry_doubts.h"
#include "core/brachytherapy/structures/tested_organs.h"
#include "core/geometry/surface/surface_bvh.h"

namespace brachy {
namespace {

constexpr double kFastMmS =
    120;  // a needle's in a clinic (core/DESIGN.md): of the tip for 5 % of the session, of a train
constexpr double kLeastHarmPercent = 0.5;  // less is what a session as planned varies by
constexpr double kStructureWeight = 1e6, kPunctureWeight = 0.5 * SeedAssignment::kFarthestMm;
constexpr double kOutsideMm = 2;  // beyond the gland, and beyond where it was planned

/// Beside the template: said so.
std::string hole_text(const std::string& hole) {
  return hole.empty() ? "beside the template" : hole;
}

std::optional<double> known(double time_s) {
  return std::isfinite(time_s) ? std::optional(time_s) : std::nullopt;
}

class Mistakes {
 public:
  Mistakes(const Score& score, const Plan& plan, const TemplateGrid& grid, const NeedleCosts* costs,
           const SurfaceBvh& gland)
      : score_(score), costs_(costs), plan_(plan), grid_(grid), gland_(gland), seeds_(plan.seeds(grid)) {}

  Findings find() && {
    add_all(organ_findings(score_.contacts));
    if (score_.seeds) {
      assign_seeds();
      explanation_ = explain(deviations_);
      for (const Cause& cause : explanation_.causes) tell(cause);
      missing();
      unplanned();
      unexplained();
    }
    lost();
    punctures();
    speed();
    for (Finding& finding : found_.all)
      if (!finding.at_s) finding.at_s = time_of(finding);
    rank();
    add_all(missed_goal_findings(score_.goals, score_.dose));
    tell_entry_doubts();
    return std::move(found_);
  }

 private:
  Finding& add(const char* cause, double weight, std::string text) {
    return found_.all.emplace_back(Finding{.text = std::move(text), .cause = cause, .weight = weight});
  }

  /// When the seeds of a finding, or those of its needles, fell; of missing ones, when the last of their needle did.
  std::optional<double> time_of(const Finding& finding) const {
    if (!score_.seeds) return std::nullopt;
    const bool is_missing = finding.cause == "missing";
    std::optional<double> time_s;
    for (std::size_t i = 0; i < seeds_.size(); ++i) {
      const bool is_its_needles =
          std::ranges::find(finding.needles, seeds_[i].needle) != finding.needles.end();
      const bool is_its_own = std::ranges::find(finding.seeds, i) != finding.seeds.end();
      if (!fell_s_[i] || !(is_missing || finding.seeds.empty() ? is_its_needles : is_its_own)) continue;
      if (!time_s || (is_missing ? *fell_s_[i] > *time_s : *fell_s_[i] < *time_s)) time_s = fell_s_[i];
    }
    return time_s;
  }

  void add_all(std::vector<Finding> findings) { std::ranges::move(findings, std::back_inserter(found_.all)); }

  // With what it did to the dose: V100 in points of a percentage.
  Finding& add_costly(const char* cause, double weight, std::string text, const DoseChange& cost) {
    Finding& finding = add(cause, weight, std::move(text));
    finding.cost = cost;
    finding.text += cost_text(cost);
    const double harm = cost.harm_percent(score_.dose.prescription_gy);
    if (harm > kLeastHarmPercent) finding.harm_percent = harm;
    return finding;
  }

  void rank() {
    const auto order = [](const Finding& f) {
      // In steps, so that rounding decides nothing.
      return std::tuple(f.is_of_organ, f.is_of_organ ? f.weight : std::round(10 * f.harm_percent), f.weight);
    };
    std::ranges::stable_sort(found_.all, std::greater(), order);
  }

  // By the number in the plan, which tells the needle that a seed came from; a seed without one, by where it lies.
  void assign_seeds() {
    std::vector<const Seed*> fallen(seeds_.size(), nullptr);
    for (const SeedScore& seed : score_.seeds->planned) fallen[seed.planned_index] = &seed.seed;
    std::size_t without = score_.seeds->unplanned.size();
    for (const SeedScore& seed : score_.seeds->by_position.placed)
      if (seed.seed.planned < 0 && !fallen[seed.planned_index]) {
        fallen[seed.planned_index] = &seed.seed;
        --without;
      }
    unplanned_ = without;
    for (const Seed* seed : fallen) fell_s_.push_back(seed ? std::optional(seed->t_s) : std::nullopt);
    deviations_.hole_spacing_mm = grid_.spacing_mm;
    deviations_.gland_centre = 0.5 * (gland_.min() + gland_.max());
    deviations_.is_unpunctured.assign(plan_.needles.size(), 0);
    for (const std::size_t n : score_.unpunctured) deviations_.is_unpunctured[n] = 1;
    for (std::size_t n = 0; n < plan_.needles.size(); ++n)
      deviations_.tips.push_back(plan_.planned_tip(grid_, n));
    for (std::size_t i = 0; i < seeds_.size(); ++i) {
      if (!fallen[i]) {
        missing_.push_back(i);
        continue;
      }
      deviations_.seeds.push_back({.index = i,
                                   .needle = seeds_[i].needle,
                                   .offset_mm = seeds_[i].offset_mm,
                                   .planned = seeds_[i].position,
                                   .dropped = fallen[i]->dropped - seeds_[i].position,
                                   .moved = fallen[i]->rest - fallen[i]->dropped});
      at_rest_.push_back(fallen[i]->at_rest());
      dropped_axis_.push_back(fallen[i]->dropped_axis);
    }
  }

  bool is_outside(const Vec3& at, const Vec3& planned) const {
    const double mm = gland_.closest_point(at).signed_distance;
    return mm > kOutsideMm && mm > gland_.closest_point(planned).signed_distance + kOutsideMm;
  }

  /// A gland that turns as it moves turns the seeds in it, too.
  static bool turns_seeds(const Cause& cause) {
    return cause.kind == Cause::Kind::kGland || cause.kind == Cause::Kind::kUnpunctured;
  }

  void tell(const Cause& cause) {
    std::vector<DoseSeed> taken, given;
    double weight = 0;
    std::size_t outside = 0;
    Finding members;
    for (const std::size_t i : cause.seeds) {
      taken.push_back(at_rest_[i]);
      given.push_back(at_rest_[i]);
      // What the hand did elsewhere, a swollen gland carried along when it shrank.
      given.back().position -= (cause.is_of_tissue() ? 1 : 1 - explanation_.shrinks_by) * cause.part[i];
      if (turns_seeds(cause)) given.back().axis = dropped_axis_[i];
      weight += cause.part[i].norm();
      outside += is_outside(at_rest_[i].position, deviations_.seeds[i].planned) &&
                 !is_outside(given.back().position, deviations_.seeds[i].planned);
      members.seeds.push_back(deviations_.seeds[i].index);
    }
    Finding& finding = add_costly(name_of(cause.kind), weight,
                                  text_of(cause, explanation_, deviations_, plan_, grid_, outside),
                                  costs_ ? costs_->against(taken, given) : DoseChange{});
    finding.seeds = std::move(members.seeds);
    if (!cause.is_of_all) finding.needles = cause.needles;
  }

  /// Where a seed that did not fall would rest if its own needle's and the template's causes had acted on it.
  DoseSeed as_expected(std::size_t index) const {
    const SeedDeviation* near = nullptr;
    std::size_t at = 0;
    for (std::size_t i = 0; i < deviations_.seeds.size(); ++i) {
      const SeedDeviation& seed = deviations_.seeds[i];
      if (seed.needle != seeds_[index].needle) continue;
      if (near && std::abs(seed.offset_mm - seeds_[index].offset_mm) >=
                      std::abs(near->offset_mm - seeds_[index].offset_mm))
        continue;
      near = &seed;
      at = i;
    }
    DoseSeed seed = seeds_[index];
    seed.position += explanation_.expected_of(seed.position, near, at);
    if (!near)
      for (const Cause& cause : explanation_.causes)
        seed.position += usual_part(cause, seeds_[index].offset_mm);
    return seed;
  }

  /// What the gland's motion, or the way of drawing back, did to seeds as far behind their needles' tips, on the mean.
  Vec3 usual_part(const Cause& cause, double offset_mm) const {
    if (cause.kind != Cause::Kind::kGland && !(cause.kind == Cause::Kind::kSpacing && cause.is_of_all))
      return Vec3::Zero();
    Vec3 sum = Vec3::Zero();
    double count = 0;
    for (std::size_t i = 0; i < deviations_.seeds.size(); ++i)
      if (std::abs(deviations_.seeds[i].offset_mm - offset_mm) < 0.5 * PlanNeedle::kSpacerMm) {
        sum += cause.part[i];
        ++count;
      }
    return count > 0 ? Vec3(sum / count) : sum;
  }

  void add_missing(const std::vector<std::size_t>& seeds, std::vector<std::size_t> needles,
                   const std::string& text) {
    std::vector<DoseSeed> given;
    for (const std::size_t i : seeds) given.push_back(as_expected(i));
    Finding& finding =
        add_costly("missing", SeedAssignment::kFarthestMm * static_cast<double>(seeds.size()),
                   text + lost_among(seeds), costs_ ? costs_->against({}, given) : DoseChange{});
    finding.seeds = seeds;
    finding.needles = std::move(needles);
  }

  std::string lost_among(const std::vector<std::size_t>& seeds) {
    std::size_t count = 0;
    if (score_.failed_drops)
      for (const FailedDrop& drop : *score_.failed_drops)
        count += drop.why == DropRefusal::kLost && drop.planned >= 0 &&
                 std::ranges::find(seeds, static_cast<std::size_t>(drop.planned)) != seeds.end();
    told_lost_ += count;
    return count == 0 ? "" : fmt::format(", {} of them lost outside the body", count);
  }

  void missing() {
    std::vector<std::vector<std::size_t>> of_needle(plan_.needles.size());
    std::vector<std::size_t> planned(plan_.needles.size(), 0);
    for (const PlannedSeed& seed : seeds_) ++planned[seed.needle];
    for (const std::size_t i : missing_) of_needle[seeds_[i].needle].push_back(i);
    std::vector<std::string> left_out;
    std::vector<std::size_t> needles_left_out, seeds_left_out;
    for (std::size_t n = 0; n < of_needle.size(); ++n) {
      if (of_needle[n].empty()) continue;
      if (of_needle[n].size() == planned[n]) {
        left_out.push_back(plan_.needles[n].hole);
        needles_left_out.push_back(n);
        seeds_left_out.insert(seeds_left_out.end(), of_needle[n].begin(), of_needle[n].end());
      } else {
        add_missing(
            of_needle[n], {n},
            fmt::format("needle {}: {} of its {} {} missing", plan_.needles[n].hole, of_needle[n].size(),
                        counted(planned[n], "seed"), of_needle[n].size() == 1 ? "is" : "are"));
      }
    }
    if (left_out.empty()) return;
    const bool is_all = left_out.size() == plan_.needles.size();
    add_missing(seeds_left_out, is_all ? std::vector<std::size_t>() : needles_left_out,
                fmt::format("{} left no seed in place: {}; {} missing", counted(left_out.size(), "needle"),
                            joined(left_out), counted(seeds_left_out.size(), "seed")));
  }

  void unplanned() {
    if (unplanned_ == 0) return;
    Finding& finding =
        add_costly("unplanned", SeedAssignment::kFarthestMm * static_cast<double>(unplanned_),
                   fmt::format("{} fell that the plan does not have", counted(unplanned_, "seed")),
                   costs_ ? costs_->of_unplanned() : DoseChange{});
    for (const Seed& seed : score_.seeds->unplanned)
      if (seed.planned < 0 && (!finding.at_s || seed.t_s < *finding.at_s)) finding.at_s = seed.t_s;
  }

  void unexplained() {
    if (!costs_ || !score_.consequences || deviations_.seeds.empty()) return;
    std::vector<Vec3> parts(at_rest_.size(), Vec3::Zero());
    std::vector<char> is_turned(at_rest_.size(), 0);
    for (const Cause& cause : explanation_.causes)
      for (const std::size_t i : cause.seeds) {
        parts[i] += cause.part[i];
        is_turned[i] |= turns_seeds(cause);
      }
    std::vector<DoseSeed> taken, given;
    Unexplained left;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const double mm = (deviations_.seeds[i].dropped + deviations_.seeds[i].moved - parts[i]).norm();
      left.mean_mm += mm / static_cast<double>(parts.size());
      left.largest_mm = std::max(left.largest_mm, mm);
      if (parts[i].isZero()) continue;
      taken.push_back(at_rest_[i]);
      given.push_back(at_rest_[i]);
      given.back().position -= parts[i];
      if (is_turned[i]) given.back().axis = dropped_axis_[i];
    }
    for (const std::size_t i : missing_) given.push_back(seeds_[i]);
    const DoseChange& whole = score_.consequences->whole;
    const DoseChange explained = costs_->against(taken, given),
                     extra = unplanned_ > 0 ? costs_->of_unplanned() : DoseChange{};
    left.change = {whole.d90_gy - explained.d90_gy - extra.d90_gy,
                   whole.v100_percent - explained.v100_percent - extra.v100_percent,
                   whole.urethra_d30_gy - explained.urethra_d30_gy - extra.urethra_d30_gy,
                   whole.rectum_d2cc_gy - explained.rectum_d2cc_gy - extra.rectum_d2cc_gy};
    found_.unexplained = left;
  }

  // First of all: every figure of the page depends on them.
  void tell_entry_doubts() {
    std::vector<Finding> doubts;
    for (std::string& doubt : entry_doubts(plan_))
      doubts.push_back({.text = std::move(doubt), .cause = "entry"});
    found_.all.insert(found_.all.begin(), doubts.begin(), doubts.end());
  }

  // Those of no needle that is told of already.
  void lost() {
    if (!score_.failed_drops) return;
    std::size_t count = 0;
    for (const FailedDrop& drop : *score_.failed_drops) count += drop.why == DropRefusal::kLost;
    if (count <= told_lost_) return;
    count -= told_lost_;
    Finding& finding = add("lost", SeedAssignment::kFarthestMm * static_cast<double>(count),
                           fmt::format("{} lost outside the body",
                                       count == 1 ? "1 seed was" : fmt::format("{} seeds were", count)));
    const auto first = std::ranges::find(*score_.failed_drops, DropRefusal::kLost, &FailedDrop::why);
    finding.at_s = first->t_s;
  }

  void punctures() {
    // By hole, the needles whose seeds fell through it: one that was aside went through a neighbour's, once more than
    // the neighbour itself.
    std::map<std::string, std::set<std::int64_t>> fallen;
    if (score_.seeds) {
      const auto count = [&](const Seed& seed) {
        if (const auto hole = grid_.nearest(seed.dropped, seed.dropped_axis))
          fallen[*hole].insert(seed.planned < 0 ? -1
                                                : static_cast<std::int64_t>(
                                                      seeds_[static_cast<std::size_t>(seed.planned)].needle));
      };
      for (const SeedScore& seed : score_.seeds->by_position.placed) count(seed.seed);
      for (const Seed& seed : score_.seeds->by_position.extra) count(seed);
    }
    std::vector<std::string> empty, again;
    std::size_t in_vain = 0, too_many = 0;
    double vain_s = kNoNumber, again_s = kNoNumber;  // the first of them
    for (const NeedleScore& needle : score_.needles.needles) {
      const std::size_t times = needle.insertions.value_or(0);
      const std::size_t usual = std::max<std::size_t>(1, fallen[needle.hole].size());
      const std::string name = hole_text(needle.hole);
      if (times > 0 && !needle.planned && fallen[needle.hole].empty()) {
        empty.push_back(name);
        in_vain += times;
        vain_s = std::fmin(vain_s, needle.insertions_s.front());
      } else if (times > usual) {
        again.push_back(fmt::format("{} {} times", name, times));
        too_many += times - usual;
        again_s = std::fmin(again_s, needle.insertions_s[usual]);
      }
    }
    if (in_vain > 0 && score_.seeds)
      add("empty_punctures", kPunctureWeight * static_cast<double>(in_vain),
          fmt::format("{} without a seed, through {}", counted(in_vain, "puncture"), joined(empty)))
          .at_s = vain_s;
    if (too_many > 0)
      add("punctured_again", kPunctureWeight * static_cast<double>(too_many),
          fmt::format("the gland was entered again through the same hole: {}", joined(again)))
          .at_s = again_s;
  }

  void speed() {
    std::vector<std::string> names;
    std::vector<std::size_t> needles;
    double fastest = 0;
    for (const TrainDrop& train : score_.trains) {
      if (!(train.at_least_mm_s > kFastMmS)) continue;
      names.push_back(plan_.needles[train.needle].hole);
      needles.push_back(train.needle);
      fastest = std::max(fastest, train.at_least_mm_s);
    }
    if (!names.empty()) {
      const bool is_all = names.size() == score_.trains.size() && names.size() > 1;
      add("train_speed", kPunctureWeight * fastest / kFastMmS,
          fmt::format(
              "too fast: {} drawn back at up to {:.0f} mm/s while the seeds fell{}; up to {:.0f} is usual",
              is_all              ? "every needle was"
              : names.size() == 1 ? "needle " + names[0] + " was"
                                  : counted(names.size(), "needle") + " were",
              fastest, is_all || names.size() == 1 ? "" : " (" + joined(names) + ")", kFastMmS))
          .needles = is_all ? std::vector<std::size_t>() : needles;
    }
    add_all(hasty_findings(score_.needles));
  }

  const Score& score_;
  const NeedleCosts* costs_;
  const Plan& plan_;
  const TemplateGrid& grid_;
  const SurfaceBvh& gland_;
  std::vector<PlannedSeed> seeds_;
  Deviations deviations_;
  std::vector<DoseSeed> at_rest_;   // of each of its seeds
  std::vector<Vec3> dropped_axis_;  // the same
  Explanation explanation_;
  std::vector<std::size_t> missing_;           // in seeds_
  std::vector<std::optional<double>> fell_s_;  // of each of seeds_; none: it did not
  std::size_t unplanned_ = 0, told_lost_ = 0;
  Findings found_;
};

}  // namespace

std::vector<Finding> organ_findings(const std::vector<StructureContact>& contacts) {
  std::map<std::string, StructureContact> by_name;
  std::map<std::string, std::vector<std::string>> holes;
  for (const StructureContact& contact : contacts) {
    StructureContact& all = by_name[contact.structure];
    all.passes += contact.passes;
    all.depth_mm = std::max(all.depth_mm, contact.depth_mm);
    all.time_s += contact.time_s;
    all.first_s = std::fmin(all.first_s, contact.first_s);
    holes[contact.structure].push_back(hole_text(contact.hole));
  }
  std::vector<Finding> found;
  for (const auto& [name, all] : by_name) {
    if (all.passes == 0) continue;
    if (name == TestedOrgan::kBone) {
      found.push_back({.text = fmt::format("the pubic arch stopped a needle {} (hole {})",
                                           counted(all.passes, "time"), joined(holes[name])),
                       .cause = "bone",
                       .weight = static_cast<double>(all.passes),
                       .at_s = known(all.first_s)});
      continue;
    }
    found.push_back(
        {.text = fmt::format("the {} was entered {} (hole {}), {:.1f} mm deep, for {:.1f} s", name,
                             counted(all.passes, "time"), joined(holes[name]), all.depth_mm, all.time_s),
         .cause = "organ",
         .weight = kStructureWeight * all.passes,
         .is_of_organ = true,
         .at_s = known(all.first_s)});
  }
  return found;
}

std::vector<Finding> hasty_findings(const NeedlesScore& needles) {
  const auto& motion = needles.motion;
  if (!motion || !(motion->speed_p95_mm_s > kFastMmS)) return {};
  return {{.text = fmt::format(
               "too fast: the tip moved at {:.0f} mm/s or more for one pose in twenty; up to {:.0f} is usual",
               motion->speed_p95_mm_s, kFastMmS),
           .cause = "speed",
           .weight = kPunctureWeight * motion->speed_p95_mm_s / kFastMmS}};
}

std::vector<Finding> missed_goal_findings(const std::vector<GoalResult>& goals, const DoseScore& dose) {
  std::string missed;
  for (const GoalResult& result : goals) {
    if (result.goal.is_of_plan() || result.is_met.value_or(true)) continue;
    const auto found = std::ranges::find(dose.plan.structures, result.goal.structure, &StructureDose::name);
    const DoseIndex* index = find_dose_index(result.goal.figure);
    if (found == dose.plan.structures.end() || !index ||
        !result.goal.is_met_by((*found).*index->value, dose.prescription_gy))
      continue;
    missed += (missed.empty() ? "" : "; ") + missed_text(result);
  }
  if (missed.empty()) return {};
  return {{.text = "the implant misses what the plan met: " + missed, .cause = "goals"}};
}

Findings find_mistakes(const Score& score, const Plan& plan, const TemplateGrid& grid,
                       const NeedleCosts* costs, const SurfaceBvh& gland) {
  return Mistakes(score, plan, grid, costs, gland).find();
}

}  // namespace brachy
