#include "core/models/blended/blended_kernel_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/work_budget.h"
#include "core/injectivity/fold_candidate_points.h"
#include "core/models/matrix_kernel/near_field.h"

namespace brachy {
namespace {

constexpr double kSinglePrecision = 1e-5;  // of the greatest slopes: Buhmann's sum cancels near r = 1
constexpr double kCuspReach = 3;           // as in scalar_cells.cpp
constexpr double kDecided = 0.9;  // slopes below which a cell is decided without evaluating its centre

// u += Σ ψ(|X − p|/a) w: the loop over a cell's points vectorises.
template <class K>
void add_displacements(const CellPoints& X, std::span<const CellSource> sources, float inverse_radius,
                       float scale, float (*u)[CellPoints::kCount]) {
  for (const CellSource& p : sources)
    for (std::size_t k = 0; k < CellPoints::kCount; ++k) {
      const float dx = X.x[k] - p.x, dy = X.y[k] - p.y, dz = X.z[k] - p.z;
      const float r = std::sqrt(dx * dx + dy * dy + dz * dz) * inverse_radius;
      const float value = scale * K::inside(r < 1.0f ? r : 1.0f);
      u[0][k] += value * p.wx;
      u[1][k] += value * p.wy;
      u[2][k] += value * p.wz;
    }
}

}  // namespace

template <class Kernels>
BlendedKernelCells<Kernels>::BlendedKernelCells(const TissueModel<Kernels>& model, SimdTarget target,
                                                std::size_t max_landmarks)
    : model_(model), field_{&model, {}, {}, {}}, loops_(cell_loops(target)), near_loops_(near_loops(target)) {
  double least = std::numeric_limits<double>::max();
  for (std::size_t m = 0; m < model.kernels.size(); ++m) {
    reach_.emplace_back(model.kernels, m);
    least = std::min(least, model.kernels.support(m));
  }
  if constexpr (Kernels::kRows == 1) {
    scalar_gradients_ = scalar_gradients(model.kernels.psi, target);
  } else {
    for (const CompactKernel& kernel : model.kernels.kernels) shapes_.push_back(shape_of(kernel));
  }
  resolution_ = 0.25 * least;
  sizes_.reserve(max_landmarks);
  distances_.resize(max_landmarks);
  chosen_.reserve(max_landmarks);
  chosen_near_.reserve(max_landmarks);
}

template <class Kernels>
void BlendedKernelCells<Kernels>::set_field(const HeterogeneousField<Kernels>& field) noexcept {
  field_ = field;
  sizes_.clear();
  Vec3 min = Vec3::Constant(std::numeric_limits<double>::max()), max = -min;
  for (std::size_t i = 0; i < field.positions.size(); ++i) {
    sizes_.push_back(field.weights[i].norm());
    min = min.cwiseMin(field.positions[i]);
    max = max.cwiseMax(field.positions[i]);
  }
  if (!sizes_.empty()) domain_ = {0.5 * (min + max), 0.5 * (max - min).maxCoeff() + model_.largest_support()};
}

template <class Kernels>
typename BlendedKernelCells<Kernels>::Shares BlendedKernelCells<Kernels>::bound_shares(
    const Cell& cell) const noexcept {
  Shares w;
  model_.membership.bound(cell.centre, std::numbers::sqrt3 * cell.half, std::span(w).first(reach_.size()));
  return w;
}

template <class Kernels>
std::size_t BlendedKernelCells<Kernels>::find_near(const Cell& cell, std::span<const std::uint32_t> from,
                                                   std::uint32_t* to) const noexcept {
  std::size_t near = 0;
  for (const std::uint32_t i : from) {
    const double d = std::sqrt(cell.squared_distance(field_.positions[i]));
    bool reaches = false;
    for (std::size_t m = 0; m < reach_.size(); ++m) reaches |= share(i, m) > 0 && d < reach_[m].support();
    if (!reaches || sizes_[i] == 0) continue;
    distances_[near] = d;
    to[near++] = i;
  }
  return near;
}

template <class Kernels>
std::size_t BlendedKernelCells<Kernels>::narrow(const Cell& cell, std::span<const std::uint32_t> from,
                                                std::uint32_t* to, CellBounds& bounds) const noexcept {
  bounds = {};
  const std::size_t M = reach_.size(), near = find_near(cell, from, to);
  if (near == 0) return 0;
  const Shares w = bound_shares(cell);

  std::array<Sums, Membership::kMaxTissues> sums{};
  std::size_t count = 0;
  double greatest = 0, kinks = 0;
  bool is_blend = false;
  for (std::size_t k = 0; k < near; ++k) {
    const std::uint32_t i = to[k];
    const bool is_cusp = Kernels::kRows == 1 && reach_[0].has_cusp() && bounds.cusp < 0 &&
                         distances_[k] < kCuspReach * cell.half;
    bool reaches = false;
    double slope = 0;
    for (std::size_t m = 0; m < M; ++m) {
      if (w[m].value == 0 || share(i, m) == 0 || distances_[k] >= reach_[m].support()) continue;
      reaches = true;
      is_blend |= w[m].slope > 0;
      const double size = sizes_[i] * share(i, m);
      const ReachBounds::At &C = reach_[m].at(distances_[k]), &at_once = reach_[m].at(0);
      slope += share(i, m) * (w[m].value * C[1] + w[m].slope * C[0]);
      greatest += size * (w[m].value * at_once[1] + w[m].slope * at_once[0]);
      if (distances_[k] + 2 * std::numbers::sqrt3 * cell.half >= reach_[m].support())
        kinks += size * w[m].value * reach_[m].kink();
      if (is_cusp) continue;
      for (std::size_t j = 0; j < 4; ++j) sums[m].norms[j] += size * C[j];
    }
    if (!reaches) continue;
    to[count++] = i;
    if (!is_cusp) continue;
    bounds.cusp = static_cast<std::int32_t>(i);
    bounds.cusp_weight = field_.weights[i];
    bounds.cusp_slope = slope;
    bounds.slope = sizes_[i] * slope;
  }
  double by_norms = bounds.slope;
  for (std::size_t m = 0; m < M; ++m) {
    sums[m].value = sums[m].norms[0];
    sums[m].slope = sums[m].norms[1];
    by_norms += w[m].value * sums[m].slope + w[m].slope * sums[m].value;
  }
  const bool evaluates_centre = by_norms > kDecided && cell.half <= resolution_;
  for (std::size_t m = 0; m < M; ++m) {
    Sums& of = sums[m];
    if (w[m].value == 0 || of.norms[0] == 0) continue;
    if (evaluates_centre && w[m].slope > 0) {
      evaluate_centre(m, cell, {to, count}, bounds.cusp, of);
      bounds.extra_work += WorkCosts::kBlendCentrePairs + 2 * count;
    }
    add_tissue(w[m], of, bounds);
  }
  bounds.squeeze = bounds.slope;
  bounds.work = is_blend ? 4 * count + model_.membership.work() : count;
  // What is linear on both sides of a kink is interpolated to within a quarter of jump and spacing along each axis.
  bounds.rounding = kSinglePrecision * greatest + 0.25 * std::numbers::sqrt3 * cell.half * kinks;
  return count;
}

template <class Kernels>
void BlendedKernelCells<Kernels>::add_tissue(const Membership::ShareBounds& w, const Sums& of,
                                             CellBounds& bounds) noexcept {
  bounds.slope += w.value * of.slope + w.slope * of.value;
  bounds.curvature += 3 * w.value * of.norms[3] + (3 + 2 * std::numbers::sqrt3) * w.slope * of.norms[2] +
                      (w.bends + 2 * w.bend) * of.slope + w.third * of.value;
}

// Weights cancel in u, not in the sum of their sizes: from the centre on, u_m and ∇u_m change by their derivatives.
template <class Kernels>
void BlendedKernelCells<Kernels>::evaluate_centre(std::size_t m, const Cell& cell,
                                                  std::span<const std::uint32_t> sources,
                                                  std::int32_t left_out, Sums& sums) const noexcept {
  Vec3 u = Vec3::Zero();
  Mat3 gradient = Mat3::Zero();
  if constexpr (Kernels::kRows == 1) {
    for (const std::uint32_t i : sources) {
      if (static_cast<std::int32_t>(i) == left_out || share(i, m) == 0) continue;
      const Vec3 x = cell.centre - field_.positions[i], f = share(i, m) * field_.weights[i];
      u += model_.kernels.value(m, x) * f;
      gradient += model_.kernels.gradient(m, x, f);
    }
  } else {  // one by one these are slow
    CellGradients A;
    CellDisplacements all;
    sum(m, cell, sources, left_out, CellPoints{}, A, &all);
    u = Vec3(all.u[0][0], all.u[1][0], all.u[2][0]);
    for (Eigen::Index e = 0; e < 9; ++e)
      gradient(e / 3, e % 3) = static_cast<double>(A.a[static_cast<std::size_t>(e)][0]);
  }
  const double radius = std::numbers::sqrt3 * cell.half, rounding = kSinglePrecision * sums.norms[0];
  const double slope =
      gradient.rowwise().norm().sum() + kSinglePrecision * sums.norms[1] + radius * sums.norms[2];
  const double value = u.norm() + rounding + radius * slope;
  sums.slope = std::min(sums.slope, slope);
  sums.value = std::min(sums.value, value);
}

template <>
void BlendedKernelCells<ScalarKernels>::sum(std::size_t m, const Cell& cell,
                                            std::span<const std::uint32_t> sources, std::int32_t left_out,
                                            const CellPoints& X, CellGradients& A,
                                            CellDisplacements* u) const noexcept {
  const double a = model_.kernels.supports[m], scale = 1 / (a * a);
  chosen_.clear();
  for (const std::uint32_t i : sources) {
    if (static_cast<std::int32_t>(i) == left_out || share(i, m) == 0) continue;
    const Eigen::Vector3f p = (field_.positions[i] - cell.centre).cast<float>(),
                          f = (scale * share(i, m) * field_.weights[i]).cast<float>();
    chosen_.push_back({p.x(), p.y(), p.z(), f.x(), f.y(), f.z()});
  }
  const auto inverse = static_cast<float>(1 / a);
  scalar_gradients_(X, chosen_.data(), chosen_.size(), inverse, A);
  if (!u) return;
  *u = {};
  std::visit([&]<class K>(K) { add_displacements<K>(X, chosen_, inverse, static_cast<float>(a * a), u->u); },
             model_.kernels.psi);
}

template <>
void BlendedKernelCells<CompactKernels>::sum(std::size_t m, const Cell& cell,
                                             std::span<const std::uint32_t> sources, std::int32_t left_out,
                                             const CellPoints& X, CellGradients& A,
                                             CellDisplacements* u) const noexcept {
  const double compliance = model_.kernels.kernels[m].compliance();
  chosen_near_.clear();
  for (const std::uint32_t i : sources) {
    if (static_cast<std::int32_t>(i) == left_out || share(i, m) == 0) continue;
    const Eigen::Vector3f p = (field_.positions[i] - cell.centre).cast<float>(),
                          f = (compliance * share(i, m) * field_.weights[i]).cast<float>();
    chosen_near_.push_back({p.x(), p.y(), p.z(), 0, f.x(), f.y(), f.z(), 0});
  }
  A = {};
  near_loops_.compact_gradients(X, chosen_near_.data(), chosen_near_.size(), shapes_[m], A);
  if (!u) return;
  BlockPoints<float> points{};
  std::ranges::copy(X.x, points.x);
  std::ranges::copy(X.y, points.y);
  std::ranges::copy(X.z, points.z);
  BlockDisplacement<float> sum{};
  near_loops_.compact(points, chosen_near_.data(), chosen_near_.size(), shapes_[m], sum);
  std::copy_n(sum.ux, CellPoints::kCount, u->u[0]);
  std::copy_n(sum.uy, CellPoints::kCount, u->u[1]);
  std::copy_n(sum.uz, CellPoints::kCount, u->u[2]);
}

template <class Kernels>
void BlendedKernelCells<Kernels>::gradients(const Cell& cell, std::span<const std::uint32_t> sources,
                                            const CellBounds& bounds, const CellPoints& X,
                                            CellGradients& A) const noexcept {
  constexpr std::size_t kCount = CellPoints::kCount;
  const std::size_t M = reach_.size();
  const Shares bound = bound_shares(cell);
  const bool is_blend = std::any_of(bound.begin(), bound.begin() + static_cast<std::ptrdiff_t>(M),
                                    [](const Membership::ShareBounds& w) { return w.slope > 0; });
  if (!is_blend) {  // one tissue, all of it
    for (std::size_t m = 0; m < M; ++m)
      if (bound[m].value > 0) return sum(m, cell, sources, bounds.cusp, X, A, nullptr);
  }
  std::array<Membership::CellShares, Membership::kMaxTissues> w;
  model_.membership.shares(cell.centre, std::numbers::sqrt3 * cell.half, X, std::span(w).first(M));
  A = {};
  for (std::size_t m = 0; m < M; ++m) {
    if (bound[m].value == 0) continue;
    CellGradients A_m;
    CellDisplacements u;
    sum(m, cell, sources, bounds.cusp, X, A_m, &u);
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t k = 0; k < kCount; ++k)
          A.a[3 * i + j][k] += w[m].w[k] * A_m.a[3 * i + j][k] + u.u[i][k] * w[m].g[j][k];
  }
}

template <class Kernels>
bool BlendedKernelCells<Kernels>::fold_candidates(std::uint32_t i, Cell& cell, CellPoints& X) const noexcept {
  if (sizes_[i] == 0) return false;
  std::size_t most = 0;
  for (std::size_t m = 1; m < reach_.size(); ++m)
    if (share(i, m) > share(i, most)) most = m;
  cell = {field_.positions[i], 2 * reach_[most].steepest()};
  surround(field_.weights[i] / sizes_[i], reach_[most].steepest(), X);
  return true;
}

template class BlendedKernelCells<ScalarKernels>;
template class BlendedKernelCells<CompactKernels>;

}  // namespace brachy
