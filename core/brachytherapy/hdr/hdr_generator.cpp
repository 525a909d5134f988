#include "core/brachytherapy/hdr/hdr_generator.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/brachytherapy/hdr/dwell_optimiser.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/gland_holes.h"

namespace brachy {
namespace {

constexpr double kUrethraClearanceMm = 3, kLeastDepthMm = 2.5;
constexpr double kFirstDwellMm = 0;     // short of the gland's far side
constexpr double kBeforeMm = 2;         // a last dwell position may lie in front of its near side
constexpr double kChoicePoints = 0.3;   // share of the points, for the choice of catheters
constexpr double kLeftOutShare = 0.15;  // of the catheters at a time
constexpr int kChoiceIterations = 60;

/// The catheter of a hole with as many dwell positions as lie in the gland; none: no positions.
PlanCatheter catheter_in(const GlandHole& hole, const HdrPlan& plan) {
  PlanCatheter catheter{hole.name, std::floor(hole.far_mm - kFirstDwellMm + plan.tip_offset_mm), {}};
  for (std::size_t i = 0; i < HdrPlanLimits::kMostDwells; ++i) {
    const double at = catheter.tip_mm - plan.straight_offset_mm(i);
    if (at < std::max(hole.near_mm - kBeforeMm, 0.0)) break;
    catheter.dwell_s.push_back(0);
  }
  return catheter;
}

HdrPlan all_catheters(const std::vector<GlandHole>& holes, const HdrPlanSettings& settings) {
  HdrPlan plan;
  plan.name = settings.name;
  plan.source = settings.source;
  plan.source_strength_u = settings.implant.source_strength_u;
  plan.prescription_gy = settings.prescription_gy;
  plan.step_mm = settings.implant.step_mm;
  plan.tip_offset_mm = settings.implant.tip_offset_mm;
  for (const GlandHole& hole : holes) {
    if (hole.urethra_mm < kUrethraClearanceMm || hole.depth_mm < kLeastDepthMm) continue;
    PlanCatheter catheter = catheter_in(hole, plan);
    if (catheter.dwell_s.size() < 2) continue;
    if (catheter.tip_mm > settings.needle_length_mm)
      throw UserError("hole " + hole.name + " needs its tip " + text_of(catheter.tip_mm) +
                      " mm beyond the template and the needle is " + text_of(settings.needle_length_mm) +
                      " mm long; raise the z of template.origin_mm");
    plan.catheters.push_back(std::move(catheter));
  }
  if (plan.catheters.empty())
    throw UserError(
        "no hole of the template has a path through the gland that clears the urethra and takes two dwell "
        "positions; "
        "reduce template.spacing_mm or move template.origin_mm");
  return plan;
}

/// Which dwells belong to the catheters kept, of those of `plan`.
std::vector<std::size_t> dwells_of(const HdrPlan& plan, const std::vector<bool>& kept) {
  std::vector<std::size_t> dwells;
  std::size_t next = 0;
  for (std::size_t c = 0; c < plan.catheters.size(); ++c)
    for (std::size_t i = 0; i < plan.catheters[c].dwell_s.size(); ++i, ++next)
      if (kept[c]) dwells.push_back(next);
  return dwells;
}

template <class Progress>
void leave_out_catheters(HdrPlan& plan, DwellDoses doses, std::size_t most, Progress progress) {
  std::vector<double> times(doses.dwells(), 1);
  const std::size_t first = plan.catheters.size();
  while (plan.catheters.size() > most) {
    progress(static_cast<double>(first - plan.catheters.size()) / static_cast<double>(first - most));
    times = minimise_penalties({&doses, 1}, default_penalties(), std::move(times), kChoiceIterations);
    set_times(plan, times);
    std::vector<std::size_t> order(plan.catheters.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto total = [&](std::size_t c) {
      return std::accumulate(plan.catheters[c].dwell_s.begin(), plan.catheters[c].dwell_s.end(), 0.0);
    };
    std::ranges::stable_sort(order, {}, total);
    const std::size_t spare = plan.catheters.size() - most;
    const auto out =
        std::min(spare, std::max<std::size_t>(
                            1, static_cast<std::size_t>(kLeftOutShare * static_cast<double>(order.size()))));
    std::vector<bool> kept(order.size(), true);
    for (std::size_t k = 0; k < out; ++k) kept[order[k]] = false;
    const std::vector<std::size_t> dwells = dwells_of(plan, kept);
    doses = doses.with(dwells);
    std::vector<double> remaining;
    for (const std::size_t d : dwells) remaining.push_back(times[d]);
    times = std::move(remaining);
    std::size_t c = 0;
    std::erase_if(plan.catheters, [&](const PlanCatheter&) { return !kept[c++]; });
  }
}

}  // namespace

HdrPlan generate_hdr_plan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                          const HdrPlanSettings& settings,
                          const std::function<void(double share)>& progress) {
  const auto report = [&](double share) {
    if (progress) progress(share);
  };
  HdrPlan plan = all_catheters(find_gland_holes(structures, grid), settings);
  const auto doses_at = [&](double share) {
    return DwellDoses(plan.dwells(grid), dose_points(structures, share), plan.source, plan.source_strength_u,
                      plan.prescription_gy);
  };
  leave_out_catheters(plan, doses_at(kChoicePoints), static_cast<std::size_t>(settings.implant.max_catheters),
                      [&](double share) { report(0.5 * share); });
  report(0.5);
  set_times(plan, optimise_dwell_times(doses_at(1)));
  // Anterior rows first, as needles are inserted: those behind do not hide them from the probe.
  std::ranges::stable_sort(plan.catheters, std::greater(),
                           [&](const PlanCatheter& c) { return grid.position(c.hole)->y(); });
  std::erase_if(plan.catheters, [](const PlanCatheter& c) {
    return std::ranges::all_of(c.dwell_s, [](double s) { return s == 0; });
  });
  return plan;
}

}  // namespace brachy
