#include "core/brachytherapy/plan/plan_generator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/tissue/interior_points.h"

namespace brachy {
namespace {

constexpr double kCoverage = 0.96;    // of the gland receives the prescription, a margin above the goal
constexpr double kGoodEnough = 0.95;  // of a goal
constexpr double kStrengthStepsPerU = 1000;
constexpr std::size_t kGlandPoints = 6000, kUrethraPoints = 1500;

// In the order of preference. At the default template's 5 mm a spacing of 7 takes every other hole, 4.5 all of them:
// small glands need those to spare the urethra.
std::vector<LoadingRule> rules() {
  std::vector<LoadingRule> all;
  for (const double spacing : {7.0, 4.5})
    for (const double clearance : {5.0, 3.0})
      for (const double rim_pitch : {7.0, 10.0})
        for (const double interior_pitch : {12.0, 10.0, 15.0, 20.0, 30.0})
          all.push_back({spacing, clearance, rim_pitch, interior_pitch});
  return all;
}

/// Doses at points spread evenly over a structure, Gy, decreasing.
class SampledDose {
 public:
  SampledDose(const std::vector<Vec3>& points, const std::vector<DoseSeed>& seeds) {
    for (const Vec3& p : points) doses_.push_back(total_dose_gy(seeds, p));
    std::ranges::sort(doses_, std::greater());
  }
  /// The minimum dose to the hottest `share` of the volume.
  double at_least(double share) const {
    const auto index = static_cast<std::size_t>(share * static_cast<double>(doses_.size()));
    return doses_[std::min(index, doses_.size() - 1)];
  }
  /// The share of the volume that receives at least `dose`.
  double share_above(double dose) const {
    const auto end = std::ranges::lower_bound(doses_, dose, std::greater());
    return static_cast<double>(end - doses_.begin()) / static_cast<double>(doses_.size());
  }

 private:
  std::vector<double> doses_;
};

std::vector<Vec3> points_in(const Structure& structure, std::size_t count) {
  return fill_interior(SurfaceBvh(structure.mesh), count, 1, structure.name);
}

/// Sets the plan's strength; returns the larger one of V150 and urethra D30, as shares of their goals.
double scale(Plan& plan, const TemplateGrid& grid, const std::vector<Vec3>& gland,
             const std::vector<Vec3>& urethra) {
  const std::vector<PlannedSeed> planned = plan.seeds(grid);
  const std::vector<DoseSeed> seeds(planned.begin(), planned.end());
  const SampledDose per_u(gland, seeds);
  const double needed = plan.prescription_gy / per_u.at_least(kCoverage);
  plan.air_kerma_strength_u = std::ceil(needed * kStrengthStepsPerU) / kStrengthStepsPerU;
  const double prescription_per_u = plan.prescription_gy / plan.air_kerma_strength_u;
  const double v150 = 100 * per_u.share_above(1.5 * prescription_per_u) / PlanGoals::kMostV150;
  if (urethra.empty()) return v150;
  const double d30 = 100 * SampledDose(urethra, seeds).at_least(0.3) / prescription_per_u;
  return std::max(v150, d30 / PlanGoals::kMostUrethraD30);
}

}  // namespace

Plan generate_plan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                   const PlanSettings& settings, const std::function<void(double share)>& progress) {
  const std::vector<GlandHole> holes = find_gland_holes(structures, grid);
  const std::vector<Vec3> gland = points_in(structures.front(), kGlandPoints);
  std::vector<Vec3> in_urethra;
  if (const Structure* urethra = find_structure(structures, "urethra"))
    in_urethra = points_in(*urethra, kUrethraPoints);

  std::optional<Plan> best;
  double least = std::numeric_limits<double>::infinity();
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  const std::vector<LoadingRule> all = rules();
  std::size_t tried = 0;
  for (const LoadingRule& rule : all) {
    if (progress) progress(static_cast<double>(tried++) / static_cast<double>(all.size()));
    Plan plan = load_gland(holes, rule);
    if (plan.needles.empty()) continue;
    fewest = std::min(fewest, plan.seed_count());
    if (plan.seed_count() > settings.max_seeds) continue;
    plan.name = settings.name;
    plan.source = settings.source;
    plan.prescription_gy = settings.prescription_gy;
    const double worst = scale(plan, grid, gland, in_urethra);
    if (worst >= least) continue;
    least = worst;
    best = std::move(plan);
    if (worst <= kGoodEnough) break;
  }
  if (!best && fewest > settings.max_seeds && fewest < std::numeric_limits<std::size_t>::max())
    throw UserError("the gland needs at least " + std::to_string(fewest) + " seeds, the scene allows " +
                    std::to_string(settings.max_seeds) + "; raise seeds.max_count");
  if (!best)
    throw UserError(
        "no hole of the template has a path through the gland that is long enough and clears the urethra; "
        "reduce template.spacing_mm or move template.origin_mm");
  if (best->base_plane_mm > settings.needle_length_mm)
    throw UserError("the gland's base is " + text_of(best->base_plane_mm) +
                    " mm beyond the template and the needle " + text_of(settings.needle_length_mm) +
                    " mm long; raise the z of template.origin_mm");
  return *best;
}

}  // namespace brachy
