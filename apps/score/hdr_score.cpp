#include "apps/score/hdr_score.h"

#include <algorithm>
#include <cmath>

#include "apps/score/hdr_findings.h"
#include "apps/score/seed_assignment.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/hdr/dwell_optimiser.h"

namespace brachy {
namespace {

CatheterScore compare(const HdrPlan& plan, const TemplateGrid& grid, std::size_t planned,
                      const CatheterCourse* course) {
  CatheterScore score{.planned = planned};
  if (!course) return score;
  score.needle = course->needle;
  const Vec3 tip = plan.planned_tip(grid, planned);
  score.tip_error = course->now.front() - tip;
  score.along_mm = score.tip_error.z();
  score.across_mm = score.tip_error.head<2>().norm();
  const std::size_t count = plan.catheters[planned].dwell_s.size();
  for (const Dwell& aimed : plan.dwells_in(grid, planned)) {
    const double offset_mm = plan.offset_mm(planned, aimed.index);
    const double mm = (dwell_at(course->rest, offset_mm).position - aimed.position).norm();
    score.mean_mm += mm / static_cast<double>(count);
    score.largest_mm = std::max(score.largest_mm, mm);
  }
  return score;
}

/// How far beside its place a catheter is that is neither aside nor shifted with all others, mm.
constexpr double kEntryScatterMm = 1.5;

struct Match {
  std::vector<std::optional<std::size_t>> planned_of;  // each delivered one's
  double cost_mm2 = 0;
};

// Squared distances, so that catheters that are all shifted alike stay each its own planned one's, and none becomes its
// neighbour's. One that is none, or is missing, costs what the farthest would.
Match match(const std::vector<Eigen::Vector2d>& planned, const std::vector<Eigen::Vector2d>& delivered,
            const Eigen::Vector2d& shift, double farthest_mm) {
  const double none_mm2 = farthest_mm * farthest_mm;
  const auto cost = [&](std::size_t d, std::size_t p) {
    return (delivered[d] - planned[p] - shift).squaredNorm();
  };
  Match result{cheapest_assignment(delivered.size(), planned.size(), none_mm2, cost)};
  for (std::size_t d = 0; d < delivered.size(); ++d)
    result.cost_mm2 += result.planned_of[d] ? cost(d, *result.planned_of[d]) : none_mm2;
  return result;
}

std::vector<StructureDose> evaluated(ImplantDose& dose, const std::vector<Dwell>& dwells,
                                     const HdrPlan& plan) {
  dose.clear();
  for (const DoseSeed& seed : as_seeds(dwells, plan.source, plan.source_strength_u)) dose.add(seed);
  return dose.evaluate();
}

/// `evaluated` of the delivered dwells, which are in the order of their catheters; and what each catheter gives.
std::vector<StructureDose> evaluated_each(ImplantDose& dose, const std::vector<Dwell>& dwells,
                                          const HdrPlan& plan, std::vector<CatheterScore>& catheters) {
  dose.clear();
  std::vector<StructureDose> before = dose.evaluate();
  for (std::size_t k = 0; k < dwells.size(); ++k) {
    for (const DoseSeed& seed : as_seeds({dwells[k]}, plan.source, plan.source_strength_u)) dose.add(seed);
    if (k + 1 < dwells.size() && dwells[k + 1].catheter == dwells[k].catheter) continue;
    std::vector<StructureDose> now = dose.evaluate();
    for (std::size_t s = 0; s < now.size(); ++s)
      catheters[dwells[k].catheter].mean_gy.push_back(now[s].mean_gy - before[s].mean_gy);
    before = std::move(now);
  }
  return before;
}

}  // namespace

std::vector<const CatheterCourse*> assign_catheters(const HdrPlan& plan, const TemplateGrid& grid,
                                                    const std::vector<CatheterCourse>& catheters) {
  std::vector<Eigen::Vector2d> planned, delivered;
  for (std::size_t p = 0; p < plan.catheters.size(); ++p)
    planned.push_back(plan.planned_entry(grid, p).head<2>());
  // Where the catheter passes the template: it may have bent since.
  for (const CatheterCourse& course : catheters) delivered.push_back(course.now.back().head<2>());
  const double farthest_mm = HdrScore::kFarthestHoles * grid.spacing_mm;

  Match best = match(planned, delivered, Eigen::Vector2d::Zero(), farthest_mm);
  const double least_gain_mm2 =
      2 * kEntryScatterMm * kEntryScatterMm * std::log(2.0 + static_cast<double>(planned.size()));
  best.cost_mm2 -= least_gain_mm2;
  for (const Eigen::Vector2d& from : planned)
    for (const Eigen::Vector2d& to : delivered) {
      if ((to - from).norm() > farthest_mm) continue;
      Match shifted = match(planned, delivered, to - from, farthest_mm);
      if (shifted.cost_mm2 < best.cost_mm2) best = std::move(shifted);
    }
  std::vector<const CatheterCourse*> of(planned.size(), nullptr);
  for (std::size_t d = 0; d < catheters.size(); ++d)
    if (best.planned_of[d]) of[*best.planned_of[d]] = &catheters[d];
  return of;
}

std::vector<Dwell> delivered_dwells(const HdrPlan& plan, const std::vector<const CatheterCourse*>& courses) {
  std::vector<Dwell> delivered;
  for (std::size_t p = 0; p < plan.catheters.size(); ++p) {
    if (!courses[p]) continue;
    for (std::size_t i = 0; i < plan.catheters[p].dwell_s.size(); ++i) {
      Dwell dwell = dwell_at(courses[p]->rest, plan.offset_mm(p, i));
      dwell.catheter = p;
      dwell.index = i;
      dwell.seconds = plan.catheters[p].dwell_s[i];
      delivered.push_back(dwell);
    }
  }
  return delivered;
}

HdrScore score_hdr(const HdrPlan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                   DoseSettings settings, const std::vector<CatheterCourse>& catheters) {
  settings.prescription_gy = plan.prescription_gy;
  HdrScore score;
  score.prescription_gy = plan.prescription_gy;
  score.reoptimised_plan = plan;
  const auto courses = assign_catheters(plan, grid, catheters);
  std::vector<Dwell> delivered = delivered_dwells(plan, courses);
  for (std::size_t p = 0; p < plan.catheters.size(); ++p) {
    score.catheters.push_back(compare(plan, grid, p, courses[p]));
    std::ranges::fill(score.reoptimised_plan.catheters[p].dwell_s, 0);
  }
  for (const CatheterCourse& c : catheters)
    if (std::ranges::find(courses, &c) == courses.end()) score.unplanned.push_back(c.needle);
  ImplantDose dose(structures, settings);
  score.plan = evaluated(dose, plan.dwells(grid), plan);
  score.findings = find_hdr_mistakes(plan, grid, courses, score.unplanned, structures, settings);
  if (delivered.empty()) return score;
  for (const Dwell& dwell : delivered) score.dwells.push_back(dwell.position);
  score.delivered = evaluated_each(dose, delivered, plan, score.catheters);
  score.slices = axial_slices(structures, dose.grid(), plan.prescription_gy);
  const std::vector<double> times = optimise_dwell_times(DwellDoses(
      delivered, dose_points(structures), plan.source, plan.source_strength_u, plan.prescription_gy));
  for (std::size_t k = 0; k < delivered.size(); ++k) {
    delivered[k].seconds = times[k];
    score.reoptimised_plan.catheters[delivered[k].catheter].dwell_s[delivered[k].index] = times[k];
  }
  score.reoptimised = evaluated(dose, delivered, plan);
  return score;
}

}  // namespace brachy
