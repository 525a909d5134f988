#include "core/brachytherapy/plan/optimiser/optimise_plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/share_out.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/plan/optimiser/annealer.h"
#include "core/geometry/surface/surface_bvh.h"

namespace brachy {
namespace {

constexpr double kCustomaryCc = 50;  // the largest gland for which the counts below are customary
constexpr std::size_t kCustomaryNeedles = 25, kCustomarySeeds = 90;
// While the plan is still far from its end a third of the points shows the way: from the first temperature down to
// this one, with so many times the proposals that follow.
constexpr std::size_t kCoarse = 3, kCoarseProposals = 1;
constexpr double kFineTemperature = 0.06, kRobustTemperature = 0.2;
constexpr double kAssumedRadiusMm = 3, kAssumedBeyondMm = 3;

/// The dose of seeds at points, of the prescription; empty without any.
std::vector<float> shares_at(const std::vector<Vec3>& points, const std::vector<DoseSeed>& seeds,
                             double prescription_gy) {
  std::vector<float> shares;
  if (seeds.empty()) return shares;
  for (const Vec3& p : points)
    shares.push_back(static_cast<float>(total_dose_gy(seeds, p) / prescription_gy));
  return shares;
}

/// A search: the problem made ready, and what its chains share.
struct PlanSearch {
  const OptimiserSettings& how;
  std::vector<NeedleChoice> choices;
  PlanPoints points;
  PointObjective objective, coarse;
  DoseRows rows;
  std::vector<float> placed;
  std::size_t most_needles, most_seeds;

  PlanSearch(const std::vector<Structure>& structures, std::vector<NeedleChoice> usable, SourceModel source,
             double strength_u, double prescription_gy, const OptimiserSettings& settings,
             const std::vector<DoseSeed>& placed_seeds)
      : how(settings),
        choices(std::move(usable)),
        points(plan_points(structures, settings.points)),
        objective(settings.objective, points),
        coarse(settings.objective, points, kCoarse),
        rows(choices, points, source, strength_u, prescription_gy),
        placed(shares_at(points.points, placed_seeds, prescription_gy)) {
    most_needles = most_needles_for(points.parts.front().volume_cc, how);
    most_seeds = most_seeds_for(points.parts.front().volume_cc, how);
  }

  AnnealingSettings annealing(std::uint64_t chain) const {
    AnnealingSettings settings;
    settings.seed = how.seed * 1000 + chain;
    settings.proposals = how.proposals;
    settings.most_needles = most_needles;
    settings.most_seeds = most_seeds;
    settings.most_seeds_a_needle = how.most_seeds_a_needle;
    settings.per_needle = how.objective.per_needle;
    settings.per_seed = how.objective.per_seed;
    return settings;
  }
};

using Report = std::function<void(double share)>;

/// The best of the chains, the first one of equals.
Annealed search(const PlanSearch& problem, const std::vector<NeedleLoad>& start, const Report& progress) {
  const std::size_t chains = std::max<std::size_t>(problem.how.chains, 1);
  std::vector<Annealed> found(chains);
  share_out(chains, problem.how.threads, [&](std::size_t chain, std::size_t) {
    AnnealingSettings settings = problem.annealing(chain);
    const auto report = [&](double share) {
      if (chain == 0 && progress) progress(share);
    };
    PlannedDose coarse(problem.rows, problem.coarse, problem.placed);
    settings.last_temperature = kFineTemperature;
    settings.proposals *= kCoarseProposals;
    const Annealed from =
        anneal(problem.choices, start, coarse, settings, [&](double share) { report(0.5 * share); });
    settings = problem.annealing(chain);
    settings.first_temperature = kFineTemperature;
    PlannedDose dose(problem.rows, problem.objective, problem.placed);
    found[chain] =
        anneal(problem.choices, from.loads, dose, settings, [&](double share) { report(0.5 + 0.5 * share); });
  });
  return *std::ranges::min_element(found, {}, &Annealed::objective);
}

/// From there, over the draws of the noise.
Annealed search_robust(const PlanSearch& problem, const std::vector<Structure>& structures, const Plan& plan,
                       const std::vector<DoseSeed>& kept, const Annealed& from, const Report& progress) {
  const PlanPoints points = plan_points(structures, {800, 96, 128, 64});
  const PointObjective misplaced(PlanObjective::misplaced(), points);
  const std::size_t chains = std::max<std::size_t>(problem.how.chains, 1);
  std::vector<Annealed> found(chains);
  share_out(chains, problem.how.threads, [&](std::size_t chain, std::size_t) {
    PlannedDose planned(problem.rows, problem.objective, problem.placed);
    MisplacedDose dose(planned, problem.choices, points, misplaced, plan.source, plan.air_kerma_strength_u,
                       plan.prescription_gy, problem.how.noise, 1,
                       shares_at(points.points, kept, plan.prescription_gy));
    AnnealingSettings settings = problem.annealing(chain);
    settings.proposals = problem.how.robust_proposals;
    settings.first_temperature = kRobustTemperature;
    found[chain] = anneal(problem.choices, from.loads, dose, settings, [&](double share) {
      if (chain == 0 && progress) progress(share);
    });
  });
  return *std::ranges::min_element(found, {}, &Annealed::objective);
}

/// Needles as rows are inserted: the anterior ones first, in each from column A on. `kept`: needles of the plan, too.
void write_needles(Plan& plan, const PlanSearch& problem, const std::vector<NeedleLoad>& loads,
                   const TemplateGrid& grid, const Plan& kept = {}) {
  struct Written {
    Vec3 hole;
    double tip_mm;
    PlanNeedle needle;
  };
  std::vector<Written> all;
  for (const PlanNeedle& needle : kept.needles)
    all.push_back({grid.position(needle.hole).value(), kept.base_plane_mm - needle.retraction_mm, needle});
  for (std::size_t c = 0; c < loads.size(); ++c)
    if (loads[c].is_used())
      all.push_back({problem.choices[c].position,
                     static_cast<double>(loads[c].tip_mm),
                     {problem.choices[c].hole, 0, loads[c].train()}});
  std::ranges::stable_sort(all, [](const Written& a, const Written& b) {
    return a.hole.y() != b.hole.y() ? a.hole.y() > b.hole.y() : a.hole.x() < b.hole.x();
  });
  for (const Written& one : all) plan.base_plane_mm = std::max(plan.base_plane_mm, one.tip_mm);
  for (Written& one : all) {
    one.needle.retraction_mm = plan.base_plane_mm - one.tip_mm;
    plan.needles.push_back(std::move(one.needle));
  }
}

/// Without those through holes that are forbidden or that kept needles go through. Throws UserError where none is left.
void leave_out_holes(std::vector<NeedleChoice>& choices, const OptimiserSettings& how) {
  std::erase_if(choices, [&](const NeedleChoice& choice) {
    return std::ranges::find(how.forbidden_holes, choice.hole) != how.forbidden_holes.end() ||
           std::ranges::find(how.kept.needles, choice.hole, &PlanNeedle::hole) != how.kept.needles.end();
  });
  if (choices.empty())
    throw UserError(
        "no hole is left that leads through the gland: all are forbidden or have needles that are kept; "
        "allow "
        "some");
}

std::vector<NeedleChoice> usable_choices(const std::vector<Structure>& structures, const TemplateGrid& grid,
                                         const NeedleClearances& clearances, double needle_length_mm) {
  BlockedHoles blocked;
  std::vector<NeedleChoice> choices =
      find_needle_choices(structures, grid, clearances, needle_length_mm, &blocked);
  if (choices.empty())
    throw UserError("no hole of the template leads through the gland: " + std::to_string(blocked.urethra) +
                    " pass within " + text_of(clearances.urethra_mm) + " mm of the urethra, " +
                    std::to_string(blocked.rectum) + " within " + text_of(clearances.rectum_mm) +
                    " mm of the rectum, " + std::to_string(blocked.pubic_arch) + " within " +
                    text_of(clearances.pubic_arch_mm) + " mm of the pubic arch, and " +
                    std::to_string(blocked.too_short) +
                    " are too short; reduce template.spacing_mm or move template.origin_mm");
  return choices;
}

}  // namespace

std::size_t most_needles_for(double volume_cc, const OptimiserSettings& how) {
  if (how.most_needles > 0) return how.most_needles;
  const double share = std::max(1.0, volume_cc / kCustomaryCc);
  return static_cast<std::size_t>(std::ceil(kCustomaryNeedles * std::pow(share, 2.0 / 3)));
}

std::size_t most_seeds_for(double volume_cc, const OptimiserSettings& how) {
  if (how.most_seeds > 0) return how.most_seeds;
  return static_cast<std::size_t>(std::ceil(kCustomarySeeds * std::max(1.0, volume_cc / kCustomaryCc)));
}

std::vector<Structure> with_urethra(const std::vector<Structure>& structures, bool& assumed) {
  assumed = find_structure(structures, "urethra") == nullptr;
  std::vector<Structure> all = structures;
  if (!assumed) return all;
  Vec3 min = structures.front().mesh.vertices.front(), max = min;
  for (const Vec3& v : structures.front().mesh.vertices) {
    min = min.cwiseMin(v);
    max = max.cwiseMax(v);
  }
  constexpr std::uint32_t kAround = 24;
  SurfaceMesh tube;
  for (const double z : {min.z() - kAssumedBeyondMm, max.z() + kAssumedBeyondMm}) {
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kAround;
      tube.vertices.push_back({0.5 * (min.x() + max.x()) + kAssumedRadiusMm * std::cos(angle),
                               0.5 * (min.y() + max.y()) + kAssumedRadiusMm * std::sin(angle), z});
    }
    tube.vertices.push_back({0.5 * (min.x() + max.x()), 0.5 * (min.y() + max.y()), z});
  }
  constexpr std::uint32_t kTop = kAround + 1;
  for (std::uint32_t i = 0; i < kAround; ++i) {
    const std::uint32_t next = (i + 1) % kAround;
    tube.triangles.push_back({i, next, kTop + next});
    tube.triangles.push_back({i, kTop + next, kTop + i});
    tube.triangles.push_back({kAround, next, i});
    tube.triangles.push_back({kTop + kAround, kTop + i, kTop + next});
  }
  all.push_back({"urethra", std::move(tube)});
  return all;
}

OptimisedPlan optimise_plan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                            const PlanSettings& settings, const OptimiserSettings& how,
                            const std::function<void(double share)>& progress) {
  OptimisedPlan result;
  const std::vector<Structure> all = with_urethra(structures, result.urethra_assumed);
  Plan& plan = result.plan;
  plan.name = settings.name;
  plan.source = settings.source;
  plan.prescription_gy = settings.prescription_gy;
  plan.air_kerma_strength_u = how.strength_u;
  std::vector<NeedleChoice> choices = usable_choices(all, grid, how.clearances, settings.needle_length_mm);
  leave_out_holes(choices, how);
  const std::vector<PlannedSeed> kept_seeds = how.kept.seeds(grid);
  const std::vector<DoseSeed> kept(kept_seeds.begin(), kept_seeds.end());
  PlanSearch problem(all, std::move(choices), plan.source, how.strength_u, settings.prescription_gy, how,
                     kept);
  problem.most_seeds = std::min(problem.most_seeds, settings.max_seeds);
  problem.most_needles -= std::min(problem.most_needles, how.kept.needles.size());
  problem.most_seeds -= std::min(problem.most_seeds, kept.size());
  const double first = how.robust ? 0.4 : 1;
  Annealed found = search(problem, std::vector<NeedleLoad>(problem.choices.size()), [&](double share) {
    if (progress) progress(first * share);
  });
  if (how.robust)
    found = search_robust(problem, all, plan, kept, found, [&](double share) {
      if (progress) progress(first + (1 - first) * share);
    });
  result.objective = found.objective;
  write_needles(plan, problem, found.loads, grid, how.kept);
  if (plan.needles.empty())
    throw UserError("no seed of " + text_of(how.strength_u) +
                    " U improves the plan: its strength is too high for the " + "gland; use weaker seeds");
  return result;
}

Plan remaining_needles(const Plan& plan, const TemplateGrid& grid, const std::vector<DoseSeed>& placed,
                       const std::vector<std::int32_t>& planned) {
  const std::vector<PlannedSeed> all = plan.seeds(grid);
  std::vector<char> is_in(plan.needles.size(), 0);
  for (std::size_t s = 0; s < placed.size(); ++s) {
    const std::int32_t number = s < planned.size() ? planned[s] : -1;
    if (number >= 0 && static_cast<std::size_t>(number) < all.size()) {
      is_in[all[static_cast<std::size_t>(number)].needle] = 1;
    } else if (const auto hole = grid.nearest(placed[s].position, Vec3::UnitZ())) {
      const auto of = std::ranges::find(plan.needles, *hole, &PlanNeedle::hole);
      if (of != plan.needles.end()) is_in[static_cast<std::size_t>(of - plan.needles.begin())] = 1;
    }
  }
  Plan left = plan;
  left.needles.clear();
  for (std::size_t n = 0; n < plan.needles.size(); ++n)
    if (!is_in[n]) left.needles.push_back(plan.needles[n]);
  return left;
}

OptimiserSettings replan_settings(std::uint64_t seed) {
  OptimiserSettings how;
  how.seed = seed;
  how.proposals = 40'000;
  how.points = {1600, 128, 192, 96};
  return how;
}

OptimisedPlan replan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                     const Plan& remaining, const std::vector<DoseSeed>& placed, double needle_length_mm,
                     const OptimiserSettings& how) {
  OptimisedPlan result;
  const std::vector<Structure> all = with_urethra(structures, result.urethra_assumed);
  result.plan = remaining;
  std::vector<NeedleChoice> choices = usable_choices(all, grid, how.clearances, needle_length_mm);
  leave_out_holes(choices, how);
  PlanSearch problem(all, std::move(choices), remaining.source, remaining.air_kerma_strength_u,
                     remaining.prescription_gy, how, placed);
  problem.most_needles = remaining.needles.size();
  std::vector<NeedleLoad> start(problem.choices.size());
  for (const PlanNeedle& needle : remaining.needles) {
    const auto at = std::ranges::find(problem.choices, needle.hole, &NeedleChoice::hole);
    if (at == problem.choices.end() || needle.train.size() > NeedleLoad::kMostElements) continue;
    NeedleLoad load = NeedleLoad::from(
        static_cast<int>(std::floor(remaining.base_plane_mm - needle.retraction_mm)), needle.train);
    load.trim();
    if (at->holds(load)) start[static_cast<std::size_t>(at - problem.choices.begin())] = load;
  }
  const Annealed found = search(problem, start, {});
  result.objective = found.objective;
  result.plan.needles.clear();
  write_needles(result.plan, problem, found.loads, grid);
  return result;
}

}  // namespace brachy
