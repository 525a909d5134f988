#include "core/brachytherapy/plan/optimiser/plan_objective.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <optional>

#include "core/base/simd/simd_attributes.h"

namespace brachy {
namespace {

using Side = PenaltyTerm::Side;
constexpr std::size_t kBlock = 128;  // points whose doses stay in the L1 cache from loop to loop

/// Adds each point's penalties to sums[term], by lanes of every kBlock-th point: the order of the sums does not depend
/// on the vectors' width.
BRACHY_INLINE void evaluate_part(const PointObjective::Part& part, const float* dose,
                                 std::span<const RowChange> rows, float* changed, double* sums) {
  alignas(64) float x[kBlock], lanes[PointObjective::kMostTerms][kBlock];
  for (int t = 0; t < part.terms; ++t)
    for (float& lane : lanes[t]) lane = 0;
  for (std::size_t start = 0; start < part.count; start += kBlock) {
    const std::size_t at = part.first + start;
    const int n = static_cast<int>(std::min(kBlock, part.count - start));
    for (int k = 0; k < n; ++k) x[k] = dose[at + static_cast<std::size_t>(k)];
    for (const RowChange& change : rows) {
      const float* row = change.row + at;
      const float sign = change.sign;
      for (int k = 0; k < n; ++k) x[k] += sign * row[k];
    }
    if (changed) {
      float* out = changed + at;
      for (int k = 0; k < n; ++k) out[k] = x[k];
    }
    for (int t = 0; t < part.terms; ++t) {
      const float sign = part.term[t].sign, threshold = part.term[t].threshold, cap = part.term[t].cap;
      float* __restrict lane = lanes[t];
      for (int k = 0; k < n; ++k) lane[k] += std::min(std::max(sign * (x[k] - threshold), 0.0f), cap);
    }
  }
  for (int t = 0; t < part.terms; ++t) {
    sums[t] = 0;
    for (const float lane : lanes[t]) sums[t] += static_cast<double>(lane);
  }
}

BRACHY_INLINE double evaluate_parts(std::span<const PointObjective::Part> parts, const float* dose,
                                    std::span<const RowChange> rows, float* changed) {
  double total = 0;
  for (const PointObjective::Part& part : parts) {
    double sums[PointObjective::kMostTerms] = {};
    evaluate_part(part, dose, rows, changed, sums);
    for (int t = 0; t < part.terms; ++t) {
      const PointObjective::Term& term = part.term[t];
      const double mean = sums[t] * term.mean_scale;
      total += term.weight * mean + term.excess * std::max(0.0, mean - term.allowed);
    }
  }
  return total;
}

using Evaluate = double (*)(std::span<const PointObjective::Part>, const float*, std::span<const RowChange>,
                            float*);

// NOLINTBEGIN(bugprone-macro-parentheses): an attribute cannot stand in parentheses.
#define BRACHY_TARGET_OBJECTIVE(name, attribute)                                        \
  attribute double name(std::span<const PointObjective::Part> parts, const float* dose, \
                        std::span<const RowChange> rows, float* changed) {              \
    return evaluate_parts(parts, dose, rows, changed);                                  \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_TARGET_OBJECTIVE(evaluate_generic, )
BRACHY_TARGET_OBJECTIVE(evaluate_sse4, BRACHY_SSE4)
BRACHY_TARGET_OBJECTIVE(evaluate_avx2, BRACHY_AVX2)
BRACHY_TARGET_OBJECTIVE(evaluate_avx512, BRACHY_AVX512)

Evaluate best_evaluate() {
  static const Evaluate generic = evaluate_generic, sse4 = evaluate_sse4, avx2 = evaluate_avx2,
                        avx512 = evaluate_avx512;
  static const Evaluate best = loops_for(best_simd_target(), generic, sse4, avx2, avx512);
  return best;
}

bool concerns(const PenaltyTerm& term, const PlanPoints::Part& part, bool is_gland) {
  const std::string_view name = is_gland ? "prostate" : std::string_view(part.structure);
  if (!term.structure.empty()) return term.structure == name;
  return name != "prostate" && name != "urethra" && name != "rectum";
}

/// "V100": 100; "D0.1cc": 0.1.
double number_in(const std::string& figure) {
  return std::strtod(figure.c_str() + 1, nullptr);
}

/// The penalty of a plan that misses the goal; nothing for a goal above a volume in cm³, of which points do not know
/// how much there is beyond them.
std::optional<PenaltyTerm> term_of(const DoseGoal& goal) {
  constexpr double kInside = 0.03, kExcessAbove = 20, kExcessBelow = 125;
  constexpr double kShareInside = 0.9;  // of what is allowed
  const DoseIndex* index = find_dose_index(goal.figure);
  if (!index) return {};
  const bool is_dose = index->unit == DoseIndex::Unit::kGy;
  const bool is_of_cc = goal.figure.ends_with("cc");
  const double number = number_in(goal.figure);
  if (is_of_cc && goal.is_above()) return {};
  // Each goal says that at most, or at least, some volume has at least this dose.
  const double dose = (is_dose ? goal.limit : number) / 100;
  const double volume = is_dose ? number : goal.limit;  // % or cm³
  PenaltyTerm term{goal.structure,
                   goal.is_above() ? Side::kBelow : Side::kAbove,
                   goal.is_above() ? dose + kInside : dose - kInside,
                   kInside,
                   0,
                   goal.is_above() ? kExcessBelow : kExcessAbove,
                   0,
                   0};
  if (is_of_cc)
    term.allowed_cc = kShareInside * volume;
  else
    term.allowed = kShareInside * (goal.is_above() ? 1 - volume / 100 : volume / 100);
  return term;
}

}  // namespace

PlanObjective PlanObjective::standard() {
  PlanObjective objective;
  objective.terms = {
      // structure, side, threshold, cap, weight, excess, allowed, allowed_cc
      {"prostate", Side::kBelow, 1.05, 0, 20, 0, 0, 0},
      {"prostate", Side::kBelow, 1.03, 0.03, 20, 125, 0.005, 0},
      {"prostate", Side::kAbove, 1.46, 0.05, 0.1, 10, 0.44, 0},
      {"prostate", Side::kAbove, 1.925, 0.1, 0.1, 10, 0.19, 0},
      {"urethra", Side::kAbove, 1.20, 0, 1, 0, 0, 0},
      {"urethra", Side::kAbove, 1.16, 0.05, 0, 4, 0.26, 0},
      {"urethra", Side::kAbove, 1.24, 0.05, 0, 6, 0.07, 0},
      {"rectum", Side::kAbove, 0.90, 0, 5, 0, 0, 0},
      {"rectum", Side::kAbove, 0.95, 0.05, 0, 20, 0, 0.4},
      {"", Side::kAbove, 1.00, 0, 2, 0, 0, 0},
  };
  return objective;
}

PlanObjective PlanObjective::with_margin() {
  constexpr double kMargin = 0.09;
  constexpr double kUrethra = 3;  // more coverage must not be bought with it
  PlanObjective objective = standard();
  for (PenaltyTerm& term : objective.terms) {
    if (term.side == Side::kBelow) term.threshold += kMargin;
    if (term.side == Side::kBelow && term.cap > 0) {  // coverage is the draws' matter
      term.weight = 4;
      term.excess = 40;
      term.allowed = 0.01;
    }
    if (term.structure == "prostate" && term.side == Side::kAbove)
      term.allowed += term.threshold < 1.5 ? 0.12 : 0.08;
    if (term.structure == "urethra" && term.cap > 0) term.excess *= kUrethra;
  }
  return objective;
}

PlanObjective PlanObjective::misplaced() {
  PlanObjective objective;
  objective.terms = {
      {"prostate", Side::kBelow, 1.00, 0, 60, 0, 0, 0},
      {"prostate", Side::kBelow, 1.01, 0.02, 12, 240, 0.030, 0},
      {"urethra", Side::kAbove, 1.20, 0, 6, 0, 0, 0},
      {"rectum", Side::kAbove, 0.95, 0, 12, 0, 0, 0},
  };
  objective.per_needle = objective.per_seed = 0;
  return objective;
}

void PlanObjective::add_goals(const std::vector<DoseGoal>& goals) {
  for (const DoseGoal& goal : goals)
    if (goal.is_of_plan())
      if (auto term = term_of(goal)) terms.push_back(std::move(*term));
}

PointObjective::PointObjective(const PlanObjective& objective, const PlanPoints& points, std::size_t every) {
  for (const PlanPoints::Part& from : points.parts) {
    const std::size_t count = (from.count + every - 1) / every;
    Part part{from.first, count, 0, {}};
    for (const PenaltyTerm& term : objective.terms) {
      if (part.terms == kMostTerms || !concerns(term, from, &from == points.parts.data())) continue;
      const double cap = term.cap > 0 ? term.cap : 1;
      part.term[part.terms++] = {
          term.side == Side::kAbove ? 1.0f : -1.0f,
          static_cast<float>(term.threshold),
          term.cap > 0 ? static_cast<float>(term.cap) : std::numeric_limits<float>::infinity(),
          1 / (cap * static_cast<double>(count)),
          term.weight,
          term.excess,
          term.allowed_cc > 0 ? term.allowed_cc / from.volume_cc : term.allowed};
    }
    parts_.push_back(part);
  }
}

double PointObjective::with(const float* dose, std::span<const RowChange> rows, float* changed) const {
  return best_evaluate()(parts_, dose, rows, changed);
}

}  // namespace brachy
