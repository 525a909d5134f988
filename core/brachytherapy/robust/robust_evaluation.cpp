#include "core/brachytherapy/robust/robust_evaluation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/base/even_places.h"
#include "core/base/number_text.h"
#include "core/base/set_up.h"
#include "core/base/share_out.h"
#include "core/brachytherapy/dose/dose_loops.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/geometry/surface/surface_bvh.h"

namespace brachy {
namespace {

// Points inside each structure.
constexpr double kGlandPoints = 8000, kUrethraPoints = 2000, kOrganPoints = 5000;
constexpr double kMostStepMm = 3;
constexpr std::size_t kMostPlaces = 1'000'000;  // of a box that its structure hardly fills
constexpr std::size_t kDrawsAtOnce = 64;        // between two reports of progress

/// By how much a value misses its limit, as a share of it; 0: it does not.
double missed_by(const DoseGoal& goal, double value, double prescription_gy) {
  const double limit = goal.limit_for(prescription_gy);
  const double beyond = goal.is_above() ? limit - value : value - limit;
  return std::max(0.0, beyond) / std::max(limit, 1e-9);
}

}  // namespace

Vec3 middle_of(const Structure& structure) {
  Vec3 least = structure.mesh.vertices.front(), most = least;
  for (const Vec3& v : structure.mesh.vertices) {
    least = least.cwiseMin(v);
    most = most.cwiseMax(v);
  }
  return 0.5 * (least + most);
}

DrawnDose::DrawnDose(const std::vector<Structure>& structures, const DoseGrid& grid, double prescription_gy,
                     const UncertaintySettings& uncertainty)
    : middle_(middle_of(structures.front())), prescription_gy_(prescription_gy) {
  const auto& size = grid.size();
  const Vec3 half = Vec3::Constant(grid.spacing_mm() / 2);
  const Vec3 least = grid.origin() - half, most = grid.position(size[0] - 1, size[1] - 1, size[2] - 1) + half;
  for (std::size_t s = 0; s < structures.size(); ++s) {
    const Kind kind = s == 0                                          ? Kind::kGland
                      : structures[s].role == StructureRole::kUrethra ? Kind::kUrethra
                                                                      : Kind::kOrgan;
    const double sd_mm = kind == Kind::kGland     ? uncertainty.gland_outline_mm
                         : kind == Kind::kUrethra ? uncertainty.urethra_outline_mm
                                                  : uncertainty.organ_outline_mm;
    parts_.push_back(part_of(structures[s], kind, 3 * sd_mm, least, most));
  }
}

DrawnDose::Part DrawnDose::part_of(const Structure& structure, Kind kind, double most_outward_mm,
                                   const Vec3& least, const Vec3& most) {
  const SurfaceBvh surface(structure.mesh);
  const Vec3 outward = Vec3::Constant(most_outward_mm + kMostStepMm);
  const Vec3 from = (surface.min() - outward).cwiseMax(least), to = (surface.max() + outward).cwiseMin(most);
  Part part{structure.name, kind, 0, 0, {}, {}};
  if ((to - from).minCoeff() <= 0) return part;
  const double wanted = kind == Kind::kGland     ? kGlandPoints
                        : kind == Kind::kUrethra ? kUrethraPoints
                                                 : kOrganPoints;
  // As many places in the box as put that many inside: what they find decides what the next ones stand for.
  struct Found {
    double outside_mm;
    Vec3 p;
  };
  std::vector<Found> found;
  EvenPlaces places(1);
  std::size_t tried = 0;
  for (double inside = 0; inside < wanted && tried < kMostPlaces; ++tried) {
    const Vec3 p = from + (to - from).cwiseProduct(places.next());
    const double outside_mm = surface.closest_point(p).signed_distance;
    if (outside_mm > most_outward_mm + kMostStepMm) continue;
    inside += outside_mm <= 0;
    found.push_back({outside_mm, p});
  }
  part.point_mm3 = (to - from).prod() / static_cast<double>(tried);
  part.step_mm = std::min(std::cbrt(part.point_mm3), kMostStepMm);
  std::ranges::sort(found, {}, &Found::outside_mm);
  const double depth_mm = found.empty() ? 0 : -found.front().outside_mm;
  if (depth_mm > 0 && most_outward_mm >= depth_mm)
    throw UserError("[uncertainty]: three standard deviations of the surface of " + structure.shown_name() +
                    ", " + text_of(most_outward_mm) + " mm, leave nothing of it: it is " +
                    text_of(std::round(10 * depth_mm) / 10) +
                    " mm deep at most; give gland_outline_mm, urethra_outline_mm or organ_outline_mm less");
  for (const Found& at : found) {
    for (std::size_t k = 0; k < 3; ++k)
      part.places[k].push_back(static_cast<float>(at.p[static_cast<Eigen::Index>(k)]));
    part.outside_mm.push_back(static_cast<float>(at.outside_mm));
  }
  return part;
}

double DrawnDose::outline_mm(Kind kind, const ImplantDraw& draw) {
  return kind == Kind::kGland     ? draw.gland_outline_mm
         : kind == Kind::kUrethra ? draw.urethra_outline_mm
                                  : draw.organ_outline_mm;
}

std::vector<StructureDose> DrawnDose::evaluate(const ImplantDraw& draw) const {
  std::vector<StructureDose> doses;
  std::array<std::vector<float>, 3> places;
  std::vector<float> gy;
  std::vector<DoseSample> samples;
  const DoseLoops& loops = dose_loops(best_simd_target());
  for (const Part& part : parts_) {
    // A surface's edge is soft, half a step wide, so that fewer points change sides at once; a wider one would count
    // much of what lies outside, where the dose is less.
    const double outline = outline_mm(part.kind, draw), edge_mm = part.step_mm / 2;
    const auto count = static_cast<std::size_t>(
        std::ranges::upper_bound(part.outside_mm, static_cast<float>(outline + edge_mm / 2)) -
        part.outside_mm.begin());
    const bool is_in_gland = part.kind != Kind::kOrgan;
    const auto stretch = static_cast<float>(is_in_gland ? draw.stretch : 1);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      const auto middle = static_cast<float>(middle_[axis]),
                 moved = static_cast<float>(is_in_gland ? 0 : draw.organs_moved_mm[axis]);
      places[k].assign(count + DoseScatter::kLanes, 0);
      for (std::size_t i = 0; i < count; ++i)
        places[k][i] = middle + stretch * (part.places[k][i] - middle) + moved;
    }
    gy.assign(count, 0);
    DoseScatter scatter{places[0].data(), places[1].data(), places[2].data(), {}, {}};
    for (const DoseSeed& seed : draw.seeds) {
      for (int k = 0; k < 3; ++k) {
        scatter.seed[k] = static_cast<float>(seed.position[k]);
        scatter.axis[k] = static_cast<float>(seed.axis[k]);
      }
      loops.add_points(dose_tables(seed.source), scatter, static_cast<float>(seed.air_kerma_strength_u),
                       count, gy.data());
    }
    const double point_mm3 = part.point_mm3 * std::pow(static_cast<double>(stretch), 3);
    double sum_mm3 = 0;
    samples.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const double inside = 0.5 - (static_cast<double>(part.outside_mm[i]) - outline) / edge_mm;
      samples.push_back({static_cast<double>(gy[i]), std::clamp(inside, 0.0, 1.0) * point_mm3});
      sum_mm3 += samples.back().volume_mm3;
    }
    doses.push_back(structure_dose(part.name, 1e-3 * sum_mm3, samples, prescription_gy_));
  }
  return doses;
}

double RobustGoal::quantile(double share) const {
  std::vector<double> sorted = drawn;
  const auto at = sorted.begin() + std::lround(share * static_cast<double>(sorted.size() - 1));
  std::ranges::nth_element(sorted, at);
  return *at;
}

namespace {

/// The structures that goals are of, the gland first.
std::vector<Structure> judged_structures(const std::vector<Structure>& structures,
                                         const std::vector<DoseGoal>& goals) {
  std::vector<Structure> judged = {structures.front()};
  for (std::size_t s = 1; s < structures.size(); ++s)
    if (std::ranges::count(goals, structures[s].name, &DoseGoal::structure) > 0)
      judged.push_back(structures[s]);
  return judged;
}

}  // namespace

RobustJudge::RobustJudge(const std::vector<Structure>& structures, const DoseSettings& dose,
                         const std::vector<DoseGoal>& goals, const RobustSettings& settings)
    : goals_(goals),
      settings_(settings),
      middle_(middle_of(structures.front())),
      planned_(judged_structures(structures, goals), dose),
      drawn_(planned_.structures(), planned_.grid(), dose.prescription_gy, settings.uncertainty) {}

RobustResult RobustJudge::judge(const PlannedSources& plan,
                                const std::function<void(double share)>& progress) {
  const double prescription_gy = planned_.settings().prescription_gy;
  planned_.clear();
  for (const PlannedSources::Source& source : plan.sources) planned_.add(source.seed);
  const std::vector<StructureDose> planned_doses = planned_.evaluate();
  RobustResult result;
  for (const DoseGoal& goal : goals_) {
    const double value = goal.value_in(planned_doses);
    if (goal.is_of_plan() && std::isfinite(value))
      result.goals.push_back({goal, value, std::vector<double>(settings_.draws), 0});
  }
  if (result.goals.empty())
    throw UserError("no [[goal]] of stage \"plan\" is of a structure that the scene has; add one");

  const std::size_t threads = SetUp().threads;
  for (std::size_t first = 0; first < settings_.draws; first += kDrawsAtOnce) {
    if (progress) progress(static_cast<double>(first) / static_cast<double>(settings_.draws));
    share_out(std::min(kDrawsAtOnce, settings_.draws - first), threads, [&](std::size_t i, std::size_t) {
      const std::size_t n = first + i;
      const std::vector<StructureDose> doses = drawn_.evaluate(draw_implant(
          plan, middle_, settings_.uncertainty, settings_.misplacement, settings_.random_seed, n));
      for (RobustGoal& goal : result.goals) goal.drawn[n] = goal.goal.value_in(doses);
    });
  }
  double most_missed = -1;
  for (std::size_t n = 0; n < settings_.draws; ++n) {
    std::size_t met = 0;
    double missed = 0;
    for (RobustGoal& goal : result.goals) {
      const bool is_met = goal.goal.is_met_by(goal.drawn[n], prescription_gy);
      goal.met += is_met;
      met += is_met;
      missed += missed_by(goal.goal, goal.drawn[n], prescription_gy);
    }
    result.all_met += met == result.goals.size();
    if (missed > most_missed) {
      most_missed = missed;
      result.worst = n;
    }
  }
  return result;
}

}  // namespace brachy
