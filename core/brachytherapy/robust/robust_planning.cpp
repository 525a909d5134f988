#include "core/brachytherapy/robust/robust_planning.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "core/base/set_up.h"
#include "core/base/share_out.h"
#include "core/brachytherapy/hdr/dwell_optimiser.h"

namespace brachy {
namespace {

constexpr std::size_t kDraws = 24,
                      kJudgingDraws = 192;  // that times are sought for, and that they are judged by
constexpr double kPoints = 0.12;            // share of the full number of points, of each draw
constexpr int kTries = 14, kIterationsOfTry = 50;
constexpr double kRaiseMissed = 1.35;
constexpr std::uint64_t kSeeking = 11, kJudging = 12;  // random seeds

HdrPlan with_times(HdrPlan plan, const std::vector<double>& seconds) {
  set_times(plan, seconds);
  return plan;
}

/// The doses of all dwell positions of a plan as draws have them.
std::vector<DwellDoses> drawn_doses(const HdrPlan& plan, const std::vector<Structure>& structures,
                                    const TemplateGrid& grid, const UncertaintySettings& uncertainty) {
  UncertaintySettings of_places = uncertainty;
  of_places.dwell_s = 0;  // is of a time that is still sought
  std::size_t positions = 0;
  for (const PlanCatheter& catheter : plan.catheters) positions += catheter.dwell_s.size();
  const HdrPlan each_a_second = with_times(plan, std::vector<double>(positions, 1));
  const PlannedSources sources = PlannedSources::of(each_a_second, grid);
  const std::vector<DosePoints> points = dose_points(structures, kPoints);
  const Vec3 middle = middle_of(structures.front());
  // A ball of the gland's volume stands for it where its surface moves.
  const double radius_mm = std::cbrt(points.front().volume_cc * 1e3 * 0.75 * std::numbers::inv_pi);
  std::vector<DwellDoses> all(kDraws, DwellDoses({}, {}, plan.source, 0, 1));
  share_out(kDraws, SetUp().threads, [&](std::size_t n, std::size_t) {
    const ImplantDraw draw = draw_implant(sources, middle, of_places, {}, kSeeking, n);
    std::vector<DosePoints> moved = points;
    for (DosePoints& part : moved) {
      const bool is_gland = part.role == DosePoints::Role::kTarget;
      const bool is_in_gland = is_gland || part.role == DosePoints::Role::kUrethra;
      const double scale =
          is_in_gland ? draw.stretch * (is_gland ? 1 + draw.gland_outline_mm / radius_mm : 1) : 1;
      const Vec3 shift = is_in_gland ? Vec3::Zero() : draw.organs_moved_mm;
      for (Vec3& p : part.points) p = middle + scale * (p - middle) + shift;
    }
    std::vector<Dwell> dwells;
    for (const DoseSeed& seed : draw.seeds) dwells.push_back({0, 0, seed.position, seed.axis, 1});
    const double strength =
        draw.seeds.front().air_kerma_strength_u / sources.sources.front().seed.air_kerma_strength_u;
    all[n] = DwellDoses(dwells, moved, plan.source, strength * plan.source_strength_u, plan.prescription_gy);
  });
  return all;
}

/// The figures that the penalties are of, in percent.
struct Limits {
  double least_v100 = HdrGoals::kLeastV100, most_v150 = HdrGoals::kMostV150,
         most_urethra_d10 = HdrGoals::kMostUrethraD10, most_rectum_d2cc = HdrGoals::kMostD2cc,
         most_bladder_d2cc = HdrGoals::kMostD2cc;

  /// Those of the goals, where they have them.
  explicit Limits(const std::vector<DoseGoal>& goals) {
    for (const DoseGoal& goal : goals) {
      if (!goal.is_of_plan()) continue;
      const auto is = [&](const char* structure, const char* figure, bool is_above) {
        return goal.structure == structure && goal.figure == figure && goal.is_above() == is_above;
      };
      if (is("prostate", "V100", true)) least_v100 = goal.limit;
      if (is("prostate", "V150", false)) most_v150 = goal.limit;
      if (is("urethra", "D10", false)) most_urethra_d10 = goal.limit;
      if (is("rectum", "D2cc", false)) most_rectum_d2cc = goal.limit;
      if (is("bladder", "D2cc", false)) most_bladder_d2cc = goal.limit;
    }
  }
};

/// How many of the draws miss each limit.
struct Missed {
  std::size_t cold = 0, hot = 0, urethra = 0, rectum = 0, bladder = 0;
};

Missed missed_by(std::span<const DwellDoses> all, const Limits& limits, const std::vector<double>& times) {
  Missed missed;
  for (const DwellDoses& doses : all) {
    const HdrFigures figures = hdr_figures(doses, times);
    missed.cold += figures.v100_percent < limits.least_v100;
    missed.hot += figures.v150_percent > limits.most_v150;
    missed.urethra += figures.urethra_d10_percent > limits.most_urethra_d10;
    missed.rectum += figures.rectum_d2cc_percent > limits.most_rectum_d2cc;
    missed.bladder += figures.bladder_d2cc_percent > limits.most_bladder_d2cc;
  }
  return missed;
}

/// Raises the weight of what most of the draws miss.
void raise_missed(std::vector<DwellPenalty>& penalties, const Missed& missed) {
  using Role = DosePoints::Role;
  const std::size_t most = std::max({missed.cold, missed.hot, missed.urethra, missed.rectum, missed.bladder});
  for (DwellPenalty& p : penalties) {
    if (p.role == Role::kTarget && missed.cold == most) p.least_weight *= kRaiseMissed;
    if (p.role == Role::kTarget && missed.hot == most) p.most_weight *= kRaiseMissed;
    if ((p.role == Role::kUrethra && missed.urethra == most) ||
        (p.role == Role::kRectum && missed.rectum == most) ||
        (p.role == Role::kBladder && missed.bladder == most))
      p.most_weight *= kRaiseMissed;
  }
}

}  // namespace

PlacementNoise placement_noise(const UncertaintySettings& settings, const SeedMisplacement& misplacement) {
  const double across = std::hypot(misplacement.play_mm, misplacement.across_mm);
  // Seeds migrate backwards only: half of a normal distribution.
  const double folded_mean = std::sqrt(2 * std::numbers::inv_pi);
  const double along =
      std::hypot(misplacement.along_mm, misplacement.migration_mm * std::sqrt(1 - folded_mean * folded_mean));
  PlacementNoise noise;
  noise.sd_mm = Vec3(across, across, along);
  noise.along_mm = -folded_mean * misplacement.migration_mm;
  noise.strength_percent =
      std::hypot(settings.strength_percent, settings.calculation_percent, settings.medium_percent);
  return noise;
}

HdrPlan with_robust_times(const HdrPlan& plan, const std::vector<Structure>& structures,
                          const TemplateGrid& grid, const DoseSettings& dose,
                          const std::vector<DoseGoal>& goals, const UncertaintySettings& uncertainty,
                          const std::function<void(double share)>& progress) {
  RobustJudge judge(structures, dose, goals, {uncertainty, {}, kJudgingDraws, kJudging});
  const auto met_by = [&](const HdrPlan& candidate) {
    return judge.judge(PlannedSources::of(candidate, grid)).all_met;
  };
  const std::vector<DwellDoses> doses = drawn_doses(plan, structures, grid, uncertainty);
  const Limits limits(goals);
  HdrPlan best = plan;
  std::size_t most = met_by(plan);
  std::vector<DwellPenalty> penalties = default_penalties();
  std::vector<double> times;
  for (const PlanCatheter& catheter : plan.catheters)
    times.insert(times.end(), catheter.dwell_s.begin(), catheter.dwell_s.end());
  for (int k = 0; k < kTries; ++k) {
    if (progress) progress(static_cast<double>(k) / kTries);
    times = minimise_penalties(doses, penalties, std::move(times), kIterationsOfTry);
    const HdrPlan candidate = with_times(plan, rounded_times(times));
    if (const std::size_t met = met_by(candidate); met > most) {
      most = met;
      best = candidate;
    }
    raise_missed(penalties, missed_by(doses, limits, times));
  }
  return best;
}

}  // namespace brachy
