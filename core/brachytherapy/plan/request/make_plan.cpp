#include "core/brachytherapy/plan/request/make_plan.h"

#include <algorithm>
#include <cmath>

#include "core/base/number_text.h"
#include "core/brachytherapy/dose/dose_rate.h"
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
constexpr double kLeastCovered = 0.9;
constexpr std::size_t kReachPoints = 2000, kCoveragePoints = 1500;

std::string rounded(double value, double step) {
  return text_of(std::round(value / step) * step);
}

/// "1,480"
std::string grouped(double value) {
  std::string text = std::to_string(std::lround(value));
  for (std::size_t at = text.size(); at > 3; at -= 3) text.insert(at - 3, ",");
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

void refuse_too_many_seeds(const SurfaceBvh& surface, double volume_cc, double strength_u,
                           std::size_t most_seeds, const PlanSettings& settings) {
  const double mean_cm = (surface.max() - surface.min()).sum() / 30;
  const double least_u =
      kLeastNeeded * customary_strength_u(settings.source, settings.prescription_gy, mean_cm);
  const double seeds = std::ceil(least_u / strength_u);
  if (seeds <= static_cast<double>(most_seeds)) return;
  const double stronger = std::ceil(100 * least_u / static_cast<double>(most_seeds)) / 100;
  const auto limits = source_limits(settings.source);
  const bool is_made = limits && stronger <= limits->most_u;
  throw PlanRefused("the gland of " + grouped(volume_cc) + " cc needs at least " + grouped(seeds) +
                    " seeds of " + text_of(strength_u) + " U for " + text_of(settings.prescription_gy) +
                    " Gy, and " + std::to_string(most_seeds) +
                    " are allowed; the nearest that can be planned is " +
                    (is_made ? "--strength-u " + text_of(stronger) + ", or " : std::string()) +
                    "--max-seeds and seeds.max_count of " + grouped(seeds));
}

double covered_share(const Plan& plan, const TemplateGrid& grid, const SurfaceBvh& gland) {
  const std::vector<PlannedSeed> planned = plan.seeds(grid);
  const std::vector<DoseSeed> seeds(planned.begin(), planned.end());
  const auto points = fill_interior(gland, kCoveragePoints, 2);
  const auto covered = std::ranges::count_if(
      points, [&](const Vec3& p) { return total_dose_gy(seeds, p) >= plan.prescription_gy; });
  return static_cast<double>(covered) / static_cast<double>(points.size());
}

void refuse_what_the_loader_refuses(const Plan& plan, const TemplateGrid& grid, double needle_length_mm) {
  try {
    if (parse_plan_toml(to_toml(plan), "the plan", grid, needle_length_mm) == plan) return;
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
  const SurfaceBvh surface(structures.front().mesh);
  const PlanSettings& settings = request.settings;
  refuse_unreached(structures.front(), surface, grid, settings.needle_length_mm);
  if (request.method == PlanMethod::kRule) {
    made.plan = generate_plan(structures, grid, settings, progress);
    const auto limits = source_limits(settings.source);
    const double u = made.plan.air_kerma_strength_u;
    if (limits && !(u >= limits->least_u && u <= limits->most_u))
      made.notes.push_back("strength: the rule needs " + text_of(u) + " U; " + std::string(limits->nuclide) +
                           " seeds are made of " + text_of(limits->least_u) + " … " +
                           text_of(limits->most_u) + " U");
  } else {
    OptimiserSettings how = request.how;
    how.strength_u = choose_strength(request, made.notes);
    const double volume = 1e-3 * enclosed_mm3(structures.front().mesh);
    how.most_seeds = std::min(most_seeds_for(volume, how), settings.max_seeds);
    refuse_too_many_seeds(surface, volume, how.strength_u, how.most_seeds, settings);
    made.plan = request.method == PlanMethod::kInteger
                    ? integer_plan(made.structures, grid, settings, how, request.solve)
                    : optimise_plan(made.structures, grid, settings, how, progress).plan;
    const double covered = covered_share(made.plan, grid, surface);
    if (covered < kLeastCovered)
      throw PlanRefused(
          "the best plan found with " + std::to_string(made.plan.needles.size()) + " needles and " +
          std::to_string(made.plan.seed_count()) + " seeds of " + text_of(how.strength_u) + " U covers " +
          rounded(100 * covered, 0.1) +
          " % of the gland; a plan covers at least 90 %: allow more (--max-needles, --max-seeds), "
          "stronger seeds, or a finer or nearer template");
  }
  refuse_what_the_loader_refuses(made.plan, grid, settings.needle_length_mm);
  return made;
}

}  // namespace brachy
