#include "core/brachytherapy/hdr/dwell_optimiser.h"

#include <algorithm>
#include <cmath>

namespace brachy {
namespace {

using Role = DosePoints::Role;

constexpr int kIterations = 60;       // of a round; the next goes on from where it ended
constexpr double kGoalMargin = 0.01;  // to be exceeded: points are not the whole volume, times are rounded
constexpr double kRaise = 1.5;        // of a weight whose goal is missed

/// The penalties' value at times, and their gradient.
class PenaltySum {
 public:
  PenaltySum(std::span<const DwellDoses> all, const std::vector<DwellPenalty>& penalties)
      : dwells_(all.front().dwells()) {
    for (const DwellDoses& doses : all)
      for (const DwellDoses::Rows& rows : doses.structures())
        for (const DwellPenalty& p : penalties)
          if (p.role == rows.role) parts_.push_back({&doses, rows, p});
  }

  double evaluate(const std::vector<double>& t, std::vector<double>& gradient) const {
    gradient.assign(t.size(), 0);
    double sum = 0;
    for (const Part& part : parts_)
      for (std::size_t i = 0; i < part.rows.count; ++i) {
        const double* row = part.doses->row(part.rows.first + i);
        double dose = 0;
        for (std::size_t j = 0; j < t.size(); ++j) dose += row[j] * t[j];
        const double share = 1 / static_cast<double>(part.rows.count);
        const double lacking = std::max(part.penalty.least - dose, 0.0),
                     excess = std::max(dose - part.penalty.most, 0.0);
        sum += share *
               (part.penalty.least_weight * lacking * lacking + part.penalty.most_weight * excess * excess);
        const double slope =
            2 * share * (part.penalty.most_weight * excess - part.penalty.least_weight * lacking);
        if (slope != 0)
          for (std::size_t j = 0; j < t.size(); ++j) gradient[j] += slope * row[j];
      }
    return sum;
  }

  /// A diagonal that is at least as curved as the sum in every direction: the row sums of 2 AᵀWA, whose entries are
  /// positive.
  std::vector<double> curvature() const {
    std::vector<double> bound(dwells_, 0);
    for (const Part& part : parts_)
      for (std::size_t i = 0; i < part.rows.count; ++i) {
        const double* row = part.doses->row(part.rows.first + i);
        double sum = 0;
        for (std::size_t j = 0; j < bound.size(); ++j) sum += row[j];
        const double weight = 2 * std::max(part.penalty.least_weight, part.penalty.most_weight) * sum /
                              static_cast<double>(part.rows.count);
        for (std::size_t j = 0; j < bound.size(); ++j) bound[j] += weight * row[j];
      }
    return bound;
  }

 private:
  struct Part {
    const DwellDoses* doses;
    DwellDoses::Rows rows;
    DwellPenalty penalty;
  };
  std::size_t dwells_;
  std::vector<Part> parts_;
};

void raise_weights(std::vector<DwellPenalty>& penalties, const HdrFigures& figures) {
  const auto is_above = [](double value, double most) { return value > most * (1 - kGoalMargin); };
  for (DwellPenalty& p : penalties) {
    if (p.role == Role::kTarget) {
      // Both are the target's: what one needs more of the other has less.
      if (figures.v100_percent < 100 - (100 - HdrGoals::kLeastV100) * 0.8) p.least_weight *= kRaise;
      if (is_above(figures.v150_percent, HdrGoals::kMostV150)) p.most_weight *= kRaise;
    }
    if ((p.role == Role::kUrethra && is_above(figures.urethra_d10_percent, HdrGoals::kMostUrethraD10)) ||
        (p.role == Role::kRectum && is_above(figures.rectum_d2cc_percent, HdrGoals::kMostD2cc)) ||
        (p.role == Role::kBladder && is_above(figures.bladder_d2cc_percent, HdrGoals::kMostD2cc)))
      p.most_weight *= kRaise;
  }
}

}  // namespace

std::vector<DwellPenalty> default_penalties() {
  return {{Role::kTarget, 1.04, 60, 1.45, 1},
          {Role::kUrethra, 0.9, 2, 1.08, 20},
          {Role::kRectum, 0, 0, 0.6, 20},
          {Role::kBladder, 0, 0, 0.6, 20}};
}

std::vector<double> even_times(const DwellDoses& doses) {
  constexpr double kMeanDose = 1.3;
  std::vector<double> t(doses.dwells(), 1);
  const DwellDoses::Rows& target = doses.structures().front();
  double mean = 0;
  for (const double dose : doses.doses(target, t)) mean += dose / static_cast<double>(target.count);
  for (double& v : t) v = kMeanDose / mean;
  return t;
}

void set_times(HdrPlan& plan, const std::vector<double>& seconds) {
  std::size_t next = 0;
  for (PlanCatheter& catheter : plan.catheters)
    for (double& s : catheter.dwell_s) s = seconds[next++];
}

std::vector<double> rounded_times(std::vector<double> t) {
  for (double& v : t) v = std::round(v / kDwellStepS) / std::round(1 / kDwellStepS);
  return t;
}

std::vector<double> minimise_penalties(std::span<const DwellDoses> doses,
                                       const std::vector<DwellPenalty>& penalties, std::vector<double> start,
                                       int iterations) {
  const PenaltySum sum(doses, penalties);
  const std::vector<double> curvature = sum.curvature();
  std::vector<double> t = std::move(start), ahead = t, gradient, next(t.size());
  double momentum = 1;
  for (int k = 0; k < iterations; ++k) {
    sum.evaluate(ahead, gradient);
    double uphill = 0;
    for (std::size_t j = 0; j < t.size(); ++j) {
      next[j] = std::max(0.0, ahead[j] - gradient[j] / curvature[j]);
      uphill += gradient[j] * (next[j] - t[j]);
    }
    if (uphill > 0) momentum = 1;  // the momentum leads uphill: start it again
    const double following = 0.5 * (1 + std::sqrt(1 + 4 * momentum * momentum));
    for (std::size_t j = 0; j < t.size(); ++j)
      ahead[j] = std::max(0.0, next[j] + (momentum - 1) / following * (next[j] - t[j]));
    momentum = following;
    std::swap(t, next);
  }
  return t;
}

std::vector<double> optimise_dwell_times(const DwellDoses& doses) {
  std::vector<DwellPenalty> penalties = default_penalties();
  std::vector<double> t = even_times(doses), best;
  double least = 0;
  for (int round = 0; round < kRounds; ++round) {
    t = minimise_penalties({&doses, 1}, penalties, std::move(t), kIterations);
    const std::vector<double> times = rounded_times(t);
    const HdrFigures figures = hdr_figures(doses, times);
    const double missed = figures.missed(kGoalMargin);
    if (best.empty() || missed < least) {
      best = times;
      least = missed;
    }
    if (missed == 0) break;
    raise_weights(penalties, figures);
  }
  return best;
}

}  // namespace brachy
