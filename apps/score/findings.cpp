#include "apps/score/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "apps/score/score.h"

namespace brachy {
namespace {

// A session as planned is off by 0.4 mm on the whole, 1.2 mm at most (core/README.md).
constexpr double kShiftAlongMm = 2, kShiftAcrossMm = 1;  // median of all seeds
constexpr double kScatterMm = 2;                         // standard deviation along the needle
constexpr std::size_t kLeastSeeds = 5;                   // for what is said of all seeds
constexpr double kFastMmS =
    120;  // tip speed that 5 % of the segments exceed: a needle's in a clinic (core/DESIGN.md)
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
  Mistakes(const Score& score, const Plan& plan, const TemplateGrid& grid)
      : score_(score),
        plan_(plan),
        grid_(grid),
        seeds_(plan.seeds(grid)),
        is_elsewhere_(plan.needles.size()) {}

  std::vector<Finding> find() && {
    structures();
    if (score_.seeds) {
      shifts();
      needles_elsewhere();
      missing();
    }
    punctures();
    speed();
    std::ranges::stable_sort(found_, std::greater(), &Finding::weight);
    return std::move(found_);
  }

 private:
  void add(double weight, std::string text) { found_.push_back({std::move(text), weight}); }

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
    for (const auto& [name, all] : by_name)
      if (all.passes > 0)
        add(kStructureWeight * all.passes,
            fmt::format("the {} was entered {} (hole {}), {:.1f} mm deep, for {:.1f} s", name,
                        counted(all.passes, "time"), joined(holes[name]), all.depth_mm, all.time_s));
  }

  // By the number in the plan, where it is known: by position a seed of a shifted train may be its neighbour's.
  // Medians, as the seeds of one needle in another's place are not everybody's.
  void shifts() {
    const SeedsScore& all = *score_.seeds;
    const std::vector<SeedScore>& seeds =
        all.planned.size() >= kLeastSeeds ? all.planned : all.by_position.placed;
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
    double squares = 0, near = 0;
    for (const SeedScore& seed : seeds) {
      if ((across_the_needle(seed) - across).norm() > grid_.spacing_mm) continue;
      squares += (seed.dropped.axial_mm - along) * (seed.dropped.axial_mm - along);
      ++near;
    }
    const double scatter = near > 0 ? std::sqrt(squares / near) : 0;
    if (std::abs(along) > kShiftAlongMm)
      add(n * std::abs(along), fmt::format("all needles too {}: the seeds fell {:.1f} mm {} on the whole",
                                           along < 0 ? "shallow" : "deep", std::abs(along),
                                           along < 0 ? "short of the plan" : "beyond the plan"));
    if (across.norm() > kShiftAcrossMm) {
      add(n * across.norm(), fmt::format("all needles to one side: the seeds fell {:.1f} mm off on the whole "
                                         "(x {:+.1f}, y {:+.1f})",
                                         across.norm(), across.x(), across.y()));
      across_ = across;
    }
    if (scatter > kScatterMm)
      add(n * scatter,
          fmt::format("depths scatter: the seeds' errors along the needle have a standard deviation of "
                      "{:.1f} mm",
                      scatter));
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
        add(weight + fallen[other->first].off.norm(),
            fmt::format("needles {} and {} were swapped: each went through the other's hole",
                        plan_.needles[n].hole, hole));
      else
        add(weight,
            fmt::format("needle {} went through {}: its {} lie {:.1f} mm aside", plan_.needles[n].hole, hole,
                        counted(fallen[n].count, "seed"), weight / static_cast<double>(fallen[n].count)));
    }
  }

  void missing() {
    std::vector<std::size_t> lacking(plan_.needles.size(), 0), planned(plan_.needles.size(), 0);
    for (const PlannedSeed& seed : seeds_) ++planned[seed.needle];
    for (const std::size_t i : score_.seeds->by_position.missing) ++lacking[seeds_[i].needle];
    std::vector<std::string> left_out;
    std::size_t seeds_left_out = 0;
    for (std::size_t n = 0; n < lacking.size(); ++n) {
      if (lacking[n] == 0 || is_elsewhere_[n]) continue;
      if (lacking[n] == planned[n]) {
        left_out.push_back(plan_.needles[n].hole);
        seeds_left_out += lacking[n];
      } else {
        add(SeedAssignment::kFarthestMm * static_cast<double>(lacking[n]),
            fmt::format("needle {}: {} of its {} are missing", plan_.needles[n].hole, lacking[n],
                        counted(planned[n], "seed")));
      }
    }
    if (!left_out.empty())
      add(SeedAssignment::kFarthestMm * static_cast<double>(seeds_left_out),
          fmt::format("{} left no seed in place: {}; {} missing", counted(left_out.size(), "needle"),
                      joined(left_out), counted(seeds_left_out, "seed")));
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
  const Plan& plan_;
  const TemplateGrid& grid_;
  std::vector<PlannedSeed> seeds_;
  std::vector<bool> is_elsewhere_;  // by the plan's needle
  Vec3 across_ = Vec3::Zero();      // common to all seeds, if found
  std::vector<Finding> found_;
};

}  // namespace

std::vector<Finding> find_mistakes(const Score& score, const Plan& plan, const TemplateGrid& grid) {
  return Mistakes(score, plan, grid).find();
}

}  // namespace brachy
