#include "core/brachytherapy/plan/request/make_plan.h"

#include <algorithm>
#include <cmath>

#include "core/base/number_text.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/plan/integer/integer_plan.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/plan/request/source_limits.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/surface/surface_volume.h"
#include "core/geometry/tissue/interior_points.h"

namespace brachy {
namespace {

constexpr double kReachMm = 8;          // beside the outermost holes: what their seeds still cover
constexpr double kLeastReached = 0.95;  // of the gland
constexpr double kLeastNeeded = 0.7;    // of the customary strength: no plan does with less
constexpr double kEnough = 0.9;  // of it: with that every gland of scripts/campaigns/planner.py is covered
constexpr double kLeastCoveredPercent = 90;  // where no goal says
constexpr std::size_t kReachPoints = 2000;

std::string rounded(double value, double step) {
  return text_of(std::round(value / step) * step);
}

/// "1,480"
std::string grouped(double value) {
  std::string text = std::to_string(std::lround(value));
  for (std::size_t at = text.size(); at > 3; at -= 3) text.insert(at - 3, 1, ',');
  return text;
}

void refuse_unreached(const Structure& gland, const SurfaceBvh& surface, const TemplateGrid& grid,
                      double needle_length_mm) {
  const Vec3 first = grid.position(0, 0), last = grid.position(grid.columns - 1, grid.rows - 1);
  const auto points = fill_interior(surface, kReachPoints, 1, gland.name);
  const auto reached = std::ranges::count_if(points, [&](const Vec3& p) {
    return p.x() >= first.x() - kReachMm && p.x() <= last.x() + kReachMm && p.y() >= first.y() - kReachMm &&
           p.y() <= last.y() + kReachMm && p.z() >= first.z() &&
           p.z() <= first.z() + needle_length_mm + kReachMm;
  });
  const double share = static_cast<double>(reached) / static_cast<double>(points.size());
  // A template that is beside or behind the gland is find_gland_holes' to refuse, with the origin it should have.
  if (share >= kLeastReached || reached == 0 || surface.min().z() <= first.z()) return;
  const Vec3 size = last - first, box = surface.max() - surface.min();
  throw PlanRefused("the gland has " + grouped(1e-3 * enclosed_mm3(gland.mesh)) + " cc; a template of " +
                    rounded(size.x(), 1) + " × " + rounded(size.y(), 1) + " mm and needles of " +
                    text_of(needle_length_mm) + " mm reach " + std::to_string(std::lround(100 * share)) +
                    " % of it; the nearest that can be planned is a gland within " +
                    rounded(size.x() + 2 * kReachMm, 1) + " × " + rounded(size.y() + 2 * kReachMm, 1) +
                    " mm in front of the template (this one: " + rounded(box.x(), 1) + " × " +
                    rounded(box.y(), 1) + " mm), or set template.origin_mm, columns and rows");
}

double choose_strength(const PlanRequest& request, std::vector<std::string>& notes) {
  const auto limits = source_limits(request.settings.source);
  const std::string name(to_string(request.settings.source));
  if (!limits) {
    if (request.strength_u) return *request.strength_u;
    throw PlanRefused("source " + name + " has no customary strength; name one with --strength-u");
  }
  const auto is_made = [&](double u) { return u >= limits->least_u && u <= limits->most_u; };
  if (request.strength_u && !is_made(*request.strength_u))
    throw PlanRefused("seeds of " + text_of(*request.strength_u) + " U: " + std::string(limits->nuclide) +
                      " seeds (" + name + ") are made of " + text_of(limits->least_u) + " … " +
                      text_of(limits->most_u) + " U (" + std::string(limits->reference) +
                      "); the nearest is " +
                      text_of(std::clamp(*request.strength_u, limits->least_u, limits->most_u)) + " U");
  if (request.strength_u) return *request.strength_u;
  if (is_made(request.scene_u)) return request.scene_u;
  notes.push_back("strength assumed: the scene's " + text_of(request.scene_u) + " U is none of " +
                  std::string(limits->nuclide) + " seeds, which are made of " + text_of(limits->least_u) +
                  " … " + text_of(limits->most_u) + " U; planned with the customary " +
                  text_of(limits->customary_u) + " U");
  return limits->customary_u;
}

/// What a gland needs in all, and what the request allows it.
struct SeedNeed {
  double volume_cc, customary_u;
  double seed_u;  // of each
  std::size_t most_seeds;

  double seeds_of(double share) const { return std::ceil(share * customary_u / seed_u); }
};

SeedNeed seed_need(const Structure& gland, const SurfaceBvh& surface, const OptimiserSettings& how,
                   const PlanSettings& settings) {
  SeedNeed need{1e-3 * enclosed_mm3(gland.mesh),
                customary_strength_u(settings.source, settings.prescription_gy,
                                     (surface.max() - surface.min()).sum() / 30),
                how.strength_u, 0};
  double most = static_cast<double>(most_seeds_for(need.volume_cc, how));
  if (how.most_seeds == 0) most = std::max(most, need.seeds_of(1));
  need.most_seeds = std::min(static_cast<std::size_t>(most), settings.max_seeds);
  return need;
}

/// "--strength-u 0.44, or --max-seeds and seeds.max_count of 112": a plan with that is enough.
std::string advice_on_seeds(const SeedNeed& need, SourceModel source) {
  const double stronger =
      std::ceil(100 * kEnough * need.customary_u / static_cast<double>(need.most_seeds)) / 100;
  const auto limits = source_limits(source);
  const bool is_made = limits && stronger <= limits->most_u;
  return (is_made ? "--strength-u " + text_of(stronger) + ", or " : std::string()) +
         "--max-seeds and seeds.max_count of " + grouped(need.seeds_of(kEnough));
}

void refuse_too_many_seeds(const SeedNeed& need, const PlanSettings& settings) {
  const double seeds = need.seeds_of(kLeastNeeded);
  if (seeds <= static_cast<double>(need.most_seeds)) return;
  throw PlanRefused("the gland of " + grouped(need.volume_cc) + " cc needs at least " + grouped(seeds) +
                    " seeds of " + text_of(need.seed_u) + " U for " + text_of(settings.prescription_gy) +
                    " Gy, and " + std::to_string(need.most_seeds) +
                    " are allowed; the nearest that can be planned is " +
                    advice_on_seeds(need, settings.source));
}

std::vector<StructureDose> doses_of(const Plan& plan, const TemplateGrid& grid,
                                    const std::vector<Structure>& structures) {
  DoseSettings settings;
  settings.prescription_gy = plan.prescription_gy;
  ImplantDose dose(structures, settings);
  for (const PlannedSeed& seed : plan.seeds(grid)) dose.add(seed);
  return dose.evaluate();
}

double least_v100_percent(const std::vector<DoseGoal>& goals) {
  double least = 0;
  for (const DoseGoal& goal : goals.empty() ? default_dose_goals() : goals)
    if (goal.is_of_plan() && goal.structure == "prostate" && goal.figure == "V100" && goal.is_above())
      least = std::max(least, goal.limit);
  return least > 0 ? least : kLeastCoveredPercent;
}

void refuse_uncovered(const Plan& plan, double v100, double least, const PlanRequest& request,
                      const SeedNeed& need) {
  if (v100 >= least) return;
  const bool has_few_seeds = need.seeds_of(kEnough) > static_cast<double>(need.most_seeds);
  const std::size_t usual_needles = most_needles_for(need.volume_cc, OptimiserSettings());
  const bool has_few_needles = request.how.most_needles > 0 && request.how.most_needles < usual_needles;
  std::string advice;
  if (has_few_needles) advice = "--max-needles " + std::to_string(usual_needles);
  if (has_few_needles && has_few_seeds) advice.append(", and ");
  if (has_few_seeds) advice.append(advice_on_seeds(need, request.settings.source));
  if (advice.empty())
    advice = "a finer or nearer template, whose holes are not behind the pubic arch or beside the urethra";
  throw PlanRefused("the best plan found with " + std::to_string(plan.needles.size()) + " needles and " +
                    std::to_string(plan.seed_count()) + " seeds of " + text_of(need.seed_u) + " U covers " +
                    text_of(std::floor(10 * v100) / 10) + " % of the gland, and the goal is " +
                    text_of(least) + " %; use " + advice);
}

/// The first goal of a plan that it misses, "urethra D30 131 Gy"; empty: it meets all.
std::string missed_goal(const Plan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                        const std::vector<DoseGoal>& goals) {
  const std::vector<StructureDose> doses = doses_of(plan, grid, structures);
  for (const DoseGoal& goal : goals.empty() ? default_dose_goals() : goals) {
    const double value = goal.value_in(doses);
    if (goal.is_of_plan() && std::isfinite(value) && !goal.is_met_by(value, plan.prescription_gy))
      return goal.structure + " " + goal.figure + " " + rounded(value, 0.1) + " " +
             unit_text(find_dose_index(goal.figure)->unit);
  }
  return "";
}

/// A plan with the fewest needles that meets the goals, where `plan` meets them.
Plan with_fewest_needles(const Plan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                         const PlanRequest& request, OptimiserSettings how, std::vector<std::string>& notes) {
  Plan fewest = plan;
  std::string missed = missed_goal(plan, grid, structures, request.goals);
  if (!missed.empty()) {
    notes.push_back("fewest needles: not looked for, as the plan misses " + missed);
    return plan;
  }
  // One that misses a goal, and one more than it that is not known to.
  std::size_t too_few = how.kept.needles.size();
  while (too_few + 1 < fewest.needles.size()) {
    how.most_needles = (too_few + fewest.needles.size()) / 2;
    const Plan tried = optimise_plan(structures, grid, request.settings, how).plan;
    const std::string misses = missed_goal(tried, grid, structures, request.goals);
    if (misses.empty() && tried.needles.size() < fewest.needles.size()) {
      fewest = tried;
    } else {
      too_few = how.most_needles;
      missed = misses;
    }
  }
  notes.push_back(
      "fewest needles: " + std::to_string(fewest.needles.size()) +
      (missed.empty() ? "" : "; with " + std::to_string(too_few) + " the plan found misses " + missed));
  return fewest;
}

void refuse_what_the_loader_refuses(const Plan& plan, const TemplateGrid& grid, double needle_length_mm) {
  try {
    if (parse_plan_toml(to_toml(plan, grid), "the plan", grid, needle_length_mm) == plan) return;
  } catch (const UserError& e) {
    throw PlanRefused(std::string("the plan that was found is not valid: ") + e.what());
  }
  throw PlanRefused("the plan that was found does not read back as it is; report this");
}

}  // namespace

MadePlan make_plan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                   const PlanRequest& request, const std::function<void(double share)>& progress) {
  MadePlan made;
  bool assumed = false;
  made.structures = with_urethra(structures, assumed);
  if (assumed)
    made.notes.emplace_back(
        "urethra assumed: the scene has none; a straight one of 3 mm radius along z through the middle of "
        "the gland's "
        "box stands in for it");
  std::vector<Structure> planned = made.structures;
  if (request.margins.mm > 0 || request.margins.posterior_mm > 0) {
    planned.front().mesh = with_margins(planned.front().mesh, request.margins);
    made.structures.push_back({"target", planned.front().mesh});
  }
  std::vector<Structure> of_scene = structures;
  of_scene.front() = planned.front();
  const SurfaceBvh surface(planned.front().mesh);
  const PlanSettings& settings = request.settings;
  refuse_unreached(planned.front(), surface, grid, settings.needle_length_mm);
  if (request.method == PlanMethod::kRule) {
    made.plan = generate_plan(of_scene, grid, settings, progress);
    const auto limits = source_limits(settings.source);
    const double u = made.plan.air_kerma_strength_u;
    if (limits && !(u >= limits->least_u && u <= limits->most_u))
      made.notes.push_back("strength: the rule needs " + text_of(u) + " U; " + std::string(limits->nuclide) +
                           " seeds are made of " + text_of(limits->least_u) + " … " +
                           text_of(limits->most_u) + " U");
  } else {
    OptimiserSettings how = request.how;
    how.strength_u = choose_strength(request, made.notes);
    how.objective.add_goals(request.goals);
    const SeedNeed need = seed_need(planned.front(), surface, how, settings);
    how.most_seeds = need.most_seeds;
    refuse_too_many_seeds(need, settings);
    made.plan = request.method == PlanMethod::kInteger
                    ? integer_plan(planned, grid, settings, how, request.solve)
                    : optimise_plan(planned, grid, settings, how, progress).plan;
    if (request.fewest_needles)
      made.plan = with_fewest_needles(made.plan, grid, planned, request, how, made.notes);
    const StructureDose of_target = doses_of(made.plan, grid, {planned.front()}).front();
    if (made.structures.size() > planned.size())
      made.notes.push_back("target: the gland with a margin of " + text_of(request.margins.mm) +
                           " mm, posterior " + text_of(request.margins.posterior_mm) + " mm, has " +
                           rounded(of_target.volume_cc, 0.1) + " cc, V100 " +
                           rounded(of_target.v100_percent, 0.1) + " % and D90 " +
                           rounded(of_target.d90_gy, 0.1) + " Gy");
    refuse_uncovered(made.plan, of_target.v100_percent, least_v100_percent(request.goals), request, need);
  }
  refuse_what_the_loader_refuses(made.plan, grid, settings.needle_length_mm);
  return made;
}

}  // namespace brachy
