#include "apps/score/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "apps/score/consequences.h"
#include "apps/score/score.h"
#include "core/brachytherapy/structures/tested_organs.h"

namespace brachy {
namespace {

// A session as planned is off by 0.4 mm on the whole, 1.2 mm at most (core/README.md).
constexpr double kShiftAlongMm = 2, kShiftAcrossMm = 1;  // median of all seeds
constexpr double kScatterMm = 2;                         // standard deviation along the needle
constexpr std::size_t kLeastSeeds = 5;                   // for what is said of all seeds
constexpr double kMostOfDepth = 1.0 / 3;  // of the needles: more of another depth are no exception
constexpr double kFastMmS =
    120;  // tip speed that 5 % of the segments exceed: a needle's in a clinic (core/DESIGN.md)
constexpr double kLeastHarmPercent = 0.5;  // less is what a session as planned varies by
constexpr double kStructureWeight = 1e6, kPunctureWeight = 0.5 * SeedAssignment::kFarthestMm;

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

Vec3 across_the_needle(const SeedScore& seed) {
  const Vec3 error = seed.seed.dropped - seed.planned.position;
  return error - seed.dropped.axial_mm * seed.planned.axis;
}

class Mistakes {
 public:
  Mistakes(const Score& score, const Plan& plan, const TemplateGrid& grid, const NeedleCosts* costs)
      : score_(score),
        costs_(costs),
        plan_(plan),
        grid_(grid),
        seeds_(plan.seeds(grid)),
        is_elsewhere_(plan.needles.size()),
        is_at_other_depth_(plan.needles.size()) {}

  std::vector<Finding> find() && {
    structures();
    if (score_.seeds) {
      shifts();
      needles_elsewhere();
      needles_at_other_depths();
      scatter();
      missing();
    }
    lost();
    punctures();
    speed();
    rank();
    tell_missed_goals();
    return std::move(found_);
  }

 private:
  void add(double weight, std::string text) { found_.push_back({.text = std::move(text), .weight = weight}); }

  // With what it did to the dose.
  void add_costly(double weight, std::string text, const DoseChange& cost) {
    const double prescription = score_.dose.prescription_gy;
    Finding finding{
        .text = std::move(text), .weight = weight, .harm_percent = cost.harm_percent(prescription)};
    if (!(finding.harm_percent > kLeastHarmPercent)) {
      finding.harm_percent = 0;
    } else {
      std::string costs;
      const auto tell = [&](const char* what, double change, const char* unit, double least) {
        if (std::abs(change) >= least)
          costs += fmt::format("{}{} {:+.1f} {}", costs.empty() ? "" : ", ", what, change, unit);
      };
      tell("V100", cost.v100_percent, "%", 0.1);
      tell("D90", cost.d90_gy, "Gy", 0.5);
      tell("urethra D30", cost.urethra_d30_gy, "Gy", 1);
      tell("rectum D2cc", cost.rectum_d2cc_gy, "Gy", 1);
      if (!costs.empty()) finding.text += " (" + costs + ")";
    }
    found_.push_back(std::move(finding));
  }
  DoseChange cost_of_all() const { return score_.consequences ? score_.consequences->whole : DoseChange{}; }
  DoseChange cost_of(const std::vector<std::size_t>& needles) const {
    return costs_ ? costs_->of(needles) : DoseChange{};
  }

  void rank() {
    const auto order = [](const Finding& f) {
      // In steps, so that rounding decides nothing.
      return std::tuple(f.is_of_organ, f.is_of_organ ? f.weight : std::round(10 * f.harm_percent), f.weight);
    };
    std::ranges::stable_sort(found_, std::greater(), order);
  }

  // To the most harmful mistake, or by themselves.
  void tell_missed_goals() {
    std::string missed;
    for (const GoalResult& result : score_.goals) {
      if (result.goal.is_of_plan() || result.is_met.value_or(true)) continue;
      const auto found =
          std::ranges::find(score_.dose.plan.structures, result.goal.structure, &StructureDose::name);
      const DoseIndex* index = find_dose_index(result.goal.figure);
      if (found == score_.dose.plan.structures.end() || !index ||
          !result.goal.is_met_by((*found).*index->value, score_.dose.prescription_gy))
        continue;
      missed += (missed.empty() ? "" : "; ") + missed_text(result);
    }
    if (missed.empty()) return;
    const auto worst = std::ranges::find_if(found_, [](const Finding& f) { return f.harm_percent > 0; });
    if (worst != found_.end())
      worst->text += ": " + missed;
    else
      add(0, "the implant misses what the plan met: " + missed);
  }

  void lost() {
    if (!score_.failed_drops) return;
    std::size_t count = 0;
    for (const FailedDrop& drop : *score_.failed_drops) count += drop.why == DropRefusal::kLost;
    if (count > 0)
      add(SeedAssignment::kFarthestMm * static_cast<double>(count),
          fmt::format("{} lost outside the body",
                      count == 1 ? "1 seed was" : fmt::format("{} seeds were", count)));
  }

  void structures() {
    std::map<std::string, StructureContact> by_name;
    std::map<std::string, std::vector<std::string>> holes;
    for (const StructureContact& contact : score_.contacts) {
      StructureContact& all = by_name[contact.structure];
      all.passes += contact.passes;
      all.depth_mm = std::max(all.depth_mm, contact.depth_mm);
      all.time_s += contact.time_s;
      holes[contact.structure].push_back(contact.hole.empty() ? "beside the template" : contact.hole);
    }
    for (const auto& [name, all] : by_name) {
      if (all.passes == 0) continue;
      if (name == TestedOrgan::kBone)
        add(all.passes, fmt::format("the pubic arch stopped a needle {} (hole {})",
                                    counted(all.passes, "time"), joined(holes[name])));
      else
        add(kStructureWeight * all.passes,
            fmt::format("the {} was entered {} (hole {}), {:.1f} mm deep, for {:.1f} s", name,
                        counted(all.passes, "time"), joined(holes[name]), all.depth_mm, all.time_s));
      found_.back().is_of_organ = name != TestedOrgan::kBone;
    }
  }

  // By the number in the plan, where it is known: by position a seed of a shifted train may be its neighbour's.
  // Medians, as the seeds of one needle in another's place are not everybody's.
  void shifts() {
    const std::vector<SeedScore>& seeds = seeds_of_all();
    if (seeds.size() < kLeastSeeds) return;
    const auto n = static_cast<double>(seeds.size());
    std::vector<double> axial;
    std::array<std::vector<double>, 3> lateral;
    for (const SeedScore& seed : seeds) {
      axial.push_back(seed.dropped.axial_mm);
      const Vec3 off = across_the_needle(seed);
      for (int k = 0; k < 3; ++k) lateral[static_cast<std::size_t>(k)].push_back(off[k]);
    }
    const double along = median(axial);
    const Vec3 across(median(lateral[0]), median(lateral[1]), median(lateral[2]));
    along_ = along;
    has_shift_along_ = std::abs(along) > kShiftAlongMm;
    if (has_shift_along_)
      add_costly(n * std::abs(along),
                 fmt::format("all needles too {}: the seeds fell {:.1f} mm {} on the whole",
                             along < 0 ? "shallow" : "deep", std::abs(along),
                             along < 0 ? "short of the plan" : "beyond the plan"),
                 cost_of_all());
    if (across.norm() > kShiftAcrossMm) {
      add_costly(n * across.norm(),
                 fmt::format("all needles to one side: the seeds fell {:.1f} mm off on the whole "
                             "(x {:+.1f}, y {:+.1f})",
                             across.norm(), across.x(), across.y()),
                 cost_of_all());
      across_ = across;
    }
  }

  const std::vector<SeedScore>& seeds_of_all() const {
    const SeedsScore& all = *score_.seeds;
    return all.planned.size() >= kLeastSeeds ? all.planned : all.by_position.placed;
  }

  // Of what is not told of single needles.
  void scatter() {
    double squares = 0, near = 0;
    for (const SeedScore& seed : seeds_of_all()) {
      if ((across_the_needle(seed) - across_).norm() > grid_.spacing_mm) continue;
      const double off = seed.dropped.axial_mm - along_;
      if (is_at_other_depth_[seed.planned.needle] || std::abs(off) > SeedAssignment::kFarthestMm) continue;
      squares += off * off;
      ++near;
    }
    const double deviation = near >= kLeastSeeds ? std::sqrt(squares / near) : 0;
    has_scatter_ = deviation > kScatterMm;
    if (has_scatter_)
      add_costly(
          near * deviation,
          fmt::format("depths scatter: the seeds' errors along the needle have a standard deviation of "
                      "{:.1f} mm",
                      deviation),
          cost_of_all());
  }

  // By the number in the plan. Where it is more than a few needles, their depths scatter, and none is to be named.
  void needles_at_other_depths() {
    struct Depth {
      double count = 0, sum = 0, least = 0, most = 0;  // mm beyond the others' seeds
    };
    std::map<std::size_t, Depth> depths;  // by needle
    for (const SeedScore& seed : score_.seeds->planned) {
      const double off = seed.dropped.axial_mm - along_;
      const auto [depth, is_first] = depths.try_emplace(seed.planned.needle, Depth{0, 0, off, off});
      Depth& needle = depth->second;
      ++needle.count;
      needle.sum += off;
      needle.least = std::min(needle.least, off);
      needle.most = std::max(needle.most, off);
    }
    std::map<bool, std::vector<std::size_t>> found;  // by whether they are too deep
    std::size_t count = 0;
    for (const auto& [n, depth] : depths)
      if (!is_elsewhere_[n] && (depth.least > kShiftAlongMm || depth.most < -kShiftAlongMm)) {
        found[depth.least > 0].push_back(n);
        ++count;
      }
    if (static_cast<double>(count) > kMostOfDepth * static_cast<double>(depths.size())) return;
    for (const auto& [is_deep, needles] : found) {
      std::vector<std::string> names;
      double weight = 0;
      for (const std::size_t n : needles) {
        const Depth& depth = depths[n];
        is_at_other_depth_[n] = true;
        names.push_back(
            fmt::format("{} by {:.1f} mm", plan_.needles[n].hole, std::abs(depth.sum / depth.count)));
        weight += std::abs(depth.sum);
      }
      add_costly(
          weight,
          fmt::format("{} too {}{}: {}", counted(needles.size(), "needle"), is_deep ? "deep" : "shallow",
                      has_shift_along_ ? " beside the others" : "", joined(names)),
          cost_of(needles));
    }
  }

  // By the number in the plan, which tells the needle that a seed came from.
  void needles_elsewhere() {
    struct Fallen {
      std::size_t count = 0;
      Vec3 position = Vec3::Zero(), off = Vec3::Zero();  // sums
    };
    std::vector<Fallen> fallen(plan_.needles.size());
    for (const SeedScore& seed : score_.seeds->planned) {
      Fallen& needle = fallen[seed.planned.needle];
      ++needle.count;
      needle.position += seed.seed.dropped;
      needle.off += across_the_needle(seed) - across_;
    }
    std::map<std::size_t, std::string> elsewhere;  // by needle: the hole that it went through
    for (std::size_t n = 0; n < fallen.size(); ++n) {
      if (fallen[n].count == 0) continue;
      const auto count = static_cast<double>(fallen[n].count);
      if (fallen[n].off.norm() / count < 0.5 * grid_.spacing_mm) continue;
      is_elsewhere_[n] = true;
      elsewhere[n] =
          grid_.nearest(fallen[n].position / count - across_, Vec3::UnitZ()).value_or("beside the template");
    }
    for (const auto& [n, hole] : elsewhere) {
      const auto other = std::ranges::find_if(
          elsewhere, [&, &at = hole](const auto& o) { return plan_.needles[o.first].hole == at; });
      const bool is_swapped = other != elsewhere.end() && other->second == plan_.needles[n].hole;
      if (is_swapped && other->first < n) continue;  // said already
      const double weight = fallen[n].off.norm();
      if (is_swapped)
        add_costly(weight + fallen[other->first].off.norm(),
                   fmt::format("needles {} and {} were swapped: each went through the other's hole",
                               plan_.needles[n].hole, hole),
                   cost_of({n, other->first}));
      else
        add_costly(
            weight,
            fmt::format("needle {} went through {}: its {} lie {:.1f} mm aside", plan_.needles[n].hole, hole,
                        counted(fallen[n].count, "seed"), weight / static_cast<double>(fallen[n].count)),
            cost_of({n}));
    }
  }

  void missing() {
    // A seed that fell elsewhere is not missing: by position alone, each train that is shifted by a seed's distance or
    // more would lack one.
    std::vector<char> fell(seeds_.size(), 0);
    for (const SeedScore& seed : score_.seeds->planned) fell[seed.planned_index] = 1;
    std::vector<std::size_t> lacking(plan_.needles.size(), 0), planned = lacking, astray = lacking;
    for (const PlannedSeed& seed : seeds_) ++planned[seed.needle];
    for (const std::size_t i : score_.seeds->by_position.missing)
      ++(fell[i] ? astray : lacking)[seeds_[i].needle];
    std::vector<std::string> left_out;
    std::vector<std::size_t> needles_left_out;
    std::size_t seeds_left_out = 0;
    for (std::size_t n = 0; n < lacking.size(); ++n) {
      if (is_elsewhere_[n]) continue;
      if (astray[n] > 0 && !has_shift_along_ && !has_scatter_ && !is_at_other_depth_[n])
        add_costly(
            SeedAssignment::kFarthestMm * static_cast<double>(astray[n]),
            fmt::format("needle {}: {} of its {} fell away from where {} planned", plan_.needles[n].hole,
                        astray[n], counted(planned[n], "seed"), astray[n] == 1 ? "it was" : "they were"),
            cost_of({n}));
      if (lacking[n] == 0) continue;
      if (lacking[n] == planned[n]) {
        left_out.push_back(plan_.needles[n].hole);
        needles_left_out.push_back(n);
        seeds_left_out += lacking[n];
      } else {
        add_costly(SeedAssignment::kFarthestMm * static_cast<double>(lacking[n]),
                   fmt::format("needle {}: {} of its {} {} missing", plan_.needles[n].hole, lacking[n],
                               counted(planned[n], "seed"), lacking[n] == 1 ? "is" : "are"),
                   cost_of({n}));
      }
    }
    if (!left_out.empty())
      add_costly(SeedAssignment::kFarthestMm * static_cast<double>(seeds_left_out),
                 fmt::format("{} left no seed in place: {}; {} missing", counted(left_out.size(), "needle"),
                             joined(left_out), counted(seeds_left_out, "seed")),
                 cost_of(needles_left_out));
  }

  void punctures() {
    std::map<std::string, std::size_t> fallen;  // by hole
    if (score_.seeds) {
      const auto count = [&](const Seed& seed) {
        if (const auto hole = grid_.nearest(seed.dropped, seed.dropped_axis)) ++fallen[*hole];
      };
      for (const SeedScore& seed : score_.seeds->by_position.placed) count(seed.seed);
      for (const Seed& seed : score_.seeds->by_position.extra) count(seed);
    }
    std::vector<std::string> empty, again;
    std::size_t in_vain = 0, too_many = 0;
    for (const NeedleScore& needle : score_.needles.needles) {
      const std::size_t times = needle.insertions.value_or(0);
      const std::string name = needle.hole.empty() ? "beside the template" : needle.hole;
      if (times > 0 && !needle.planned && fallen[needle.hole] == 0) {
        empty.push_back(name);
        in_vain += times;
      } else if (times > 1) {
        again.push_back(fmt::format("{} {} times", name, times));
        too_many += times - 1;
      }
    }
    if (in_vain > 0 && score_.seeds)
      add(kPunctureWeight * static_cast<double>(in_vain),
          fmt::format("{} without a seed, through {}", counted(in_vain, "puncture"), joined(empty)));
    if (too_many > 0)
      add(kPunctureWeight * static_cast<double>(too_many),
          fmt::format("the gland was entered again through the same hole: {}", joined(again)));
  }

  void speed() {
    const auto& motion = score_.needles.motion;
    if (!motion || !(motion->speed_p95_mm_s > kFastMmS)) return;
    add(kPunctureWeight * motion->speed_p95_mm_s / kFastMmS,
        fmt::format(
            "too fast: the tip moved at {:.0f} mm/s or more for one pose in twenty; up to {:.0f} is usual",
            motion->speed_p95_mm_s, kFastMmS));
  }

  const Score& score_;
  const NeedleCosts* costs_;
  const Plan& plan_;
  const TemplateGrid& grid_;
  std::vector<PlannedSeed> seeds_;
  std::vector<bool> is_elsewhere_;       // by the plan's needle
  std::vector<bool> is_at_other_depth_;  // the same
  double along_ = 0;                     // median of all seeds
  bool has_shift_along_ = false, has_scatter_ = false;
  Vec3 across_ = Vec3::Zero();  // common to all seeds, if found
  std::vector<Finding> found_;
};

}  // namespace

std::vector<Finding> find_mistakes(const Score& score, const Plan& plan, const TemplateGrid& grid,
                                   const NeedleCosts* costs) {
  return Mistakes(score, plan, grid, costs).find();
}

}  // namespace brachy
