#include "core/injectivity/injectivity_search.h"

#include <cassert>
#include <numeric>

#include "core/base/work_budget.h"

namespace brachy {
namespace {

constexpr double kHopeless = 0.8;  // interpolation error of a lattice above which no eighth can be decided

// Lattice points by eighth are two steps of half a cell apart; the remaining places repeat the centre.
CellPoints lattice_of(double half) {
  CellPoints X{};
  const auto h = static_cast<float>(half);
  for (std::size_t i = 0; i < CellPoints::kLattice; ++i) {
    X.x[i] = h * (static_cast<float>(i % 3) - 1);
    X.y[i] = h * (static_cast<float>(i / 3 % 3) - 1);
    X.z[i] = h * (static_cast<float>(i / 9) - 1);
  }
  return X;
}

// The least s in (0, limit) with det(I + s A) = 1 + t s + e₂ s² + e₃ s³ = 0, or `limit`.
double first_root(const Mat3& A, double limit) {
  const double t = A.trace(), e3 = A.determinant(), e2 = 0.5 * (t * t - (A * A).trace());
  const auto negative = [](double x) { return std::min(x, 0.0); };
  if (1 + limit * (negative(t) + limit * (negative(e2) + limit * negative(e3))) > 0) return limit;
  const auto f = [&](double s) { return 1 + s * (t + s * (e2 + s * e3)); };
  // Eigenvalues of A are at most |A|: no root before 1/|A|. From there in steps too small to skip a pair of roots that
  // matter, then by bisection.
  constexpr int kSteps = 24;
  double low = std::min(limit, 1 / std::max(A.norm(), 1e-12));
  const double grow = std::pow(limit / low, 1.0 / kSteps);
  for (int i = 0; i < kSteps; ++i) {
    const double high = i + 1 == kSteps ? limit : low * grow;
    if (f(high) <= 0) {
      double a = low, b = high;
      for (int k = 0; k < 40; ++k) (f(0.5 * (a + b)) <= 0 ? b : a) = 0.5 * (a + b);
      return b;
    }
    low = high;
  }
  return limit;
}

}  // namespace

InjectivitySearch::InjectivitySearch(std::size_t max_sources)
    : max_sources_(max_sources), candidates_((kMaxDepth + 2) * max_sources), counts_(kMaxDepth + 2) {
  stack_.reserve(8 * (kMaxDepth + 1) + 1);
}

FoldCandidate InjectivitySearch::find_fold_candidate(const CellField& field) noexcept {
  FoldCandidate fold_candidate;
  counts_[0] = field.sources();
  std::iota(candidates_.begin(), candidates_.begin() + static_cast<std::ptrdiff_t>(counts_[0]), 0u);
  for (std::uint32_t i = 0; i < counts_[0]; ++i) {
    Cell cell;
    CellPoints X;
    if (!field.fold_candidates(i, cell, X)) continue;
    std::uint32_t* chosen = &candidates_[max_sources_];
    CellBounds bounds;
    const std::size_t count = field.narrow(cell, {candidates_.data(), counts_[0]}, chosen, bounds);
    bounds.cusp = -1;
    CellGradients A;
    field.gradients(cell, {chosen, count}, bounds, X, A);
    // A root below the least so far shows as a sign at that scale or at half of it, but for pairs of roots
    // close together.
    alignas(64) float det[2][CellPoints::kCount];
    field.loops().determinants(A, static_cast<float>(fold_candidate.scale), det[0]);
    field.loops().determinants(A, static_cast<float>(0.5 * fold_candidate.scale), det[1]);
    for (std::size_t k = 0; k < CellPoints::kCount; ++k) {
      if (det[0][k] > 0 && det[1][k] > 0) continue;
      Mat3 G;
      for (std::size_t c = 0; c < 9; ++c)
        G(static_cast<Eigen::Index>(c / 3), static_cast<Eigen::Index>(c % 3)) =
            static_cast<double>(A.a[c][k]);
      if (const double s = first_root(G, fold_candidate.scale); s < fold_candidate.scale)
        fold_candidate = {s, cell.centre + X.at(k)};
    }
  }
  return fold_candidate;
}

const InjectivitySearch::Result& InjectivitySearch::run(const CellField& field, double scale,
                                                        const FoldCandidate& fold_candidate,
                                                        std::uint64_t work) noexcept {
  begin(field, scale, fold_candidate, work / WorkBudget::kRefiningPart);
  return go_on(work);
}

void InjectivitySearch::begin(const CellField& field, double scale, const FoldCandidate& fold_candidate,
                              std::uint64_t refining) noexcept {
  assert(field.sources() <= max_sources_);
  field_ = &field;
  scale_ = scale;
  refining_ = refining;
  is_too_deep_ = false;
  result_ = {};
  stack_.clear();
  if (fold_candidate.scale < FoldCandidate::kMaxScale) look_at(fold_candidate.place);
  if (result_.verdict == Verdict::kFolded) return;
  counts_[0] = field.sources();
  std::iota(candidates_.begin(), candidates_.begin() + static_cast<std::ptrdiff_t>(counts_[0]), 0u);
  if (counts_[0] > 0) stack_.push_back({field.domain(), 0});
}

// Where the work is spent, cells that their bounds decide are passed; the first other one is left for later, with what
// was spent on it.
const InjectivitySearch::Result& InjectivitySearch::go_on(std::uint64_t work) noexcept {
  limit_ = result_.work + work;
  while (!stack_.empty() && result_.verdict != Verdict::kFolded) {
    const Node node = stack_.back();
    stack_.pop_back();
    const std::uint64_t before = result_.work;
    const std::span from(&candidates_[node.depth * max_sources_], counts_[node.depth]);
    CellBounds bounds;
    const std::size_t count =
        field_->narrow(node.cell, from, &candidates_[(node.depth + 1) * max_sources_], bounds);
    counts_[node.depth + 1] = count;
    result_.work += 1 + from.size() / WorkCosts::kSourcesForPair + bounds.extra_work;
    if (count == 0 || settle(node, count, bounds)) continue;
    result_.work = before;
    stack_.push_back(node);
    break;
  }
  if (result_.verdict != Verdict::kFolded)
    result_.verdict = is_too_deep_ || !stack_.empty() ? Verdict::kUnknown : Verdict::kInjective;
  return result_;
}

// det(I + A) ≥ Π (1 − σ_i) ≥ 1 − |A|₁; and det(S + W) ≥ det S for a skew W and a positive definite S, whose eigenvalues
// are least together with two at 1 − squeeze, and the third what the trace asks for.
double InjectivitySearch::bound_by_norms(const CellBounds& bounds, double scale) noexcept {
  const double squeeze = scale * bounds.squeeze, stretch = 1 - squeeze;
  const double third = 1 + std::max(-squeeze, 2 * squeeze - scale * bounds.shrink);
  return std::max(1 - scale * bounds.slope, stretch > 0 ? stretch * stretch * third : -1);
}

double InjectivitySearch::wanted() const noexcept {
  return result_.work < refining_ ? WorkBudget::kRefinedBoundShare * std::max(result_.least_det, 0.0) : 0;
}

// False: there is no work left for it.
bool InjectivitySearch::settle(const Node& node, std::size_t count, CellBounds& bounds) noexcept {
  const double cheap = std::max(node.bound, bound_by_norms(bounds, scale_));
  // Near a cusp bounds do not get better than their limit there.
  const double wanted = bounds.cusp < 0 ? this->wanted() : 0;
  const bool is_deepest = node.depth + 1 > kMaxDepth;
  if (cheap > wanted || (cheap > 0 && is_deepest)) {
    result_.det_bound = std::min(result_.det_bound, cheap);
    return true;
  }
  if (result_.work >= limit_) return false;
  if (is_deepest) {
    is_too_deep_ = true;
    return true;
  }
  alignas(64) float lower[16];
  const auto push_undecided = [&] {
    std::fill_n(lower, 16, -1.0f);
    push_eighths(node, lower);
    return true;
  };
  if (node.cell.half > field_->resolution()) return push_undecided();
  field_->bound_curvature(node.cell, bounds);
  const double error = node.cell.half * node.cell.half / 8 * bounds.curvature + bounds.rounding;
  if (scale_ * error > kHopeless) return push_undecided();
  const std::span sources(&candidates_[(node.depth + 1) * max_sources_], count);
  CellGradients A;
  field_->gradients(node.cell, sources, bounds, lattice_of(node.cell.half), A);
  result_.work += bounds.work + WorkCosts::kLatticePairs;
  if (bounds.cusp < 0) look_at_points(node.cell, A);
  if (result_.verdict == Verdict::kFolded) return true;

  CellRemainder remainder;
  remainder.scale = static_cast<float>(scale_);
  remainder.error = static_cast<float>(error);
  remainder.cusp_slope = static_cast<float>(bounds.cusp_slope);
  remainder.wx = static_cast<float>(bounds.cusp_weight.x());
  remainder.wy = static_cast<float>(bounds.cusp_weight.y());
  remainder.wz = static_cast<float>(bounds.cusp_weight.z());
  field_->loops().bounds(A, remainder, lower);
  push_eighths(node, lower);
  return true;
}

// Eighths that are not decided yet are next.
void InjectivitySearch::push_eighths(const Node& node, const float* lower) noexcept {
  const double wanted = this->wanted();
  const double quarter = 0.5 * node.cell.half;
  for (std::size_t e = 0; e < 8; ++e) {
    const auto bound = static_cast<double>(lower[kEighths[e]]);
    if (bound > wanted) {
      result_.det_bound = std::min(result_.det_bound, bound);
      continue;
    }
    const Vec3 side((e & 1) ? 1 : -1, (e & 2) ? 1 : -1, (e & 4) ? 1 : -1);
    stack_.push_back({{node.cell.centre + quarter * side, quarter}, node.depth + 1, bound});
  }
}

void InjectivitySearch::look_at_points(const Cell& cell, const CellGradients& A) noexcept {
  alignas(64) float det[CellPoints::kCount];
  field_->loops().determinants(A, static_cast<float>(scale_), det);
  const auto least = static_cast<std::size_t>(std::min_element(det, det + CellPoints::kLattice) - det);
  if (static_cast<double>(det[least]) >= result_.least_det) return;
  const auto at = [&](std::size_t k) { return cell.half * (static_cast<double>(k) - 1); };
  const Vec3 X = cell.centre + Vec3(at(least % 3), at(least / 3 % 3), at(least / 9));
  if (field_->covers(X)) look_at(X);
}

// In double: single precision cannot distinguish a fold from a field that nearly folds.
void InjectivitySearch::look_at(const Vec3& X) noexcept {
  const double det = (Mat3::Identity() + scale_ * field_->gradient(X)).determinant();
  if (det >= result_.least_det) return;
  result_.least_det = det;
  result_.place = X;
  if (det <= 0) result_.verdict = Verdict::kFolded;
}

}  // namespace brachy
