#include "core/stability/composition.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace brachy {
namespace {

constexpr std::size_t kPoints = Tissue::kBlockSize;

}  // namespace

Composition::Composition(const Tissue& tissue, const Kernel& kernel, double support_radius, SimdTarget target,
                         std::size_t max_landmarks, std::size_t max_steps)
    : tissue_(tissue),
      kernel_(kernel),
      support_radius_(support_radius),
      loops_(block_kernels(kernel, target)),
      system_(kernel, support_radius, static_cast<int>(max_landmarks), target),
      cells_(kernel, support_radius, target, max_landmarks),
      steps_(max_steps),
      is_touched_(tissue.blocks.size()),
      displacements_(tissue.blocks.size()),
      determinants_(tissue.blocks.size() * kPoints),
      all_(max_landmarks),
      near_(max_landmarks),
      local_(max_landmarks) {
  for (Step& step : steps_) {
    step.positions.reserve(max_landmarks);
    step.weights.reserve(max_landmarks);
  }
  touched_.reserve(tissue.blocks.size());
  std::iota(all_.begin(), all_.end(), 0u);
}

void Composition::begin(std::span<const Vec3> positions, std::span<const Vec3> displacements) noexcept {
  landmarks_ = positions;
  ways_ = displacements;
  count_ = 0;
  reached_ = 0;
}

void Composition::move_landmarks() noexcept {
  assert(count_ < steps_.size());
  Step& step = steps_[count_];
  step.positions.clear();
  for (std::size_t i = 0; i < landmarks_.size(); ++i)
    step.positions.push_back(landmarks_[i] + reached_ * ways_[i]);
}

FactorStatus Composition::solve() noexcept {
  move_landmarks();
  Step& step = steps_[count_];
  FactorStatus status = system_.factorize(step.positions);
  if (status) status = FactorStatus::of_condition(system_.condition());
  if (!status) return status;
  step.weights.resize(landmarks_.size());
  system_.solve(ways_, step.weights);
  cells_.set_field(field(step));
  return {};
}

void Composition::take_first(std::span<const Vec3> weights) noexcept {
  assert(count_ == 0);
  move_landmarks();
  steps_[0].weights.assign(weights.begin(), weights.end());
  cells_.set_field(field(steps_[0]));
}

void Composition::accept(double scale) noexcept {
  steps_[count_].scale = scale;
  reached_ = std::min(1.0, reached_ + scale);
  ++count_;
}

void Composition::evaluate() noexcept {
  std::ranges::fill(is_touched_, std::uint8_t{0});
  std::ranges::fill(determinants_, 1.0f);
  least_determinant_ = 1;
  for (std::size_t k = 0; k < count_; ++k) {
    cells_.set_field(field(steps_[k]));
    for (std::uint32_t b = 0; b < tissue_.blocks.size(); ++b) apply(steps_[k], b);
  }
  touched_.clear();
  for (std::uint32_t b = 0; b < is_touched_.size(); ++b) {
    if (!is_touched_[b]) continue;
    touched_.push_back(b);
    const Block& block = tissue_.blocks[b];
    const float* det = &determinants_[b * kPoints];
    const float* least = std::min_element(det, det + block.count);
    if (static_cast<double>(*least) >= least_determinant_) continue;
    least_determinant_ = static_cast<double>(*least);
    least_place_ = tissue_.rest_vertices[block.first + static_cast<std::size_t>(least - det)];
  }
}

// One step at the points of a block, which earlier steps may have moved.
void Composition::apply(const Step& step, std::uint32_t b) noexcept {
  const Block& block = tissue_.blocks[b];
  BlockDisplacement<float>& u = displacements_[b];
  if (!is_touched_[b]) u = {};

  Vec3 min = block.min, max = block.max;
  if (is_touched_[b]) {
    const auto [x0, x1] = std::minmax_element(u.ux, u.ux + block.count);
    const auto [y0, y1] = std::minmax_element(u.uy, u.uy + block.count);
    const auto [z0, z1] = std::minmax_element(u.uz, u.uz + block.count);
    min += Vec3(*x0, *y0, *z0);
    max += Vec3(*x1, *y1, *z1);
  }
  const Cell cell{0.5 * (min + max), 0.5 * (max - min).maxCoeff()};
  CellBounds bounds;
  const std::size_t count = cells_.narrow(cell, {all_.data(), step.positions.size()}, near_.data(), bounds);
  if (count == 0) return;
  is_touched_[b] = 1;
  const std::span<const std::uint32_t> near(near_.data(), count);
  bounds.cusp = -1;

  for (std::size_t half = 0; half < kPoints; half += CellPoints::kCount) {
    CellPoints X{};
    for (std::size_t i = 0; i < CellPoints::kCount; ++i) {
      const std::size_t k = half + i < block.count ? half + i : 0;
      const Vec3 x = tissue_.rest_vertices[block.first + k] + Vec3(u.ux[k], u.uy[k], u.uz[k]) - cell.centre;
      X.x[i] = static_cast<float>(x.x());
      X.y[i] = static_cast<float>(x.y());
      X.z[i] = static_cast<float>(x.z());
    }
    CellGradients A;
    cells_.gradients(cell, near, bounds, X, A);
    alignas(64) float det[CellPoints::kCount];
    cells_.loops().determinants(A, static_cast<float>(step.scale), det);
    for (std::size_t i = 0; i < CellPoints::kCount; ++i) determinants_[b * kPoints + half + i] *= det[i];
  }
  add_displacement(step, b, near);
}

// In double throughout: sub-steps are where weights are large.
void Composition::add_displacement(const Step& step, std::uint32_t b,
                                   std::span<const std::uint32_t> sources) noexcept {
  const Block& block = tissue_.blocks[b];
  BlockDisplacement<float>& u = displacements_[b];
  const Vec3 centre = 0.5 * (block.min + block.max);
  const double inverse = 1 / support_radius_;
  for (std::size_t j = 0; j < sources.size(); ++j) {
    const Vec3 p = inverse * (step.positions[sources[j]] - centre), w = step.scale * step.weights[sources[j]];
    local_[j] = {p.x(), p.y(), p.z(), w.x(), w.y(), w.z()};
  }
  BlockPoints<double> X;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const std::size_t k = i < block.count ? i : 0;
    const Vec3 x =
        inverse * (tissue_.rest_vertices[block.first + k] + Vec3(u.ux[k], u.uy[k], u.uz[k]) - centre);
    X.x[i] = x.x();
    X.y[i] = x.y();
    X.z[i] = x.z();
  }
  BlockDisplacement<double> more;
  for (std::size_t first = 0; first < kPoints; first += kGroupSize)
    loops_.direct_double(X, first, local_.data(), all_.data(), sources.size(), more);
  for (std::size_t i = 0; i < kPoints; ++i) {
    u.ux[i] += static_cast<float>(more.ux[i]);
    u.uy[i] += static_cast<float>(more.uy[i]);
    u.uz[i] += static_cast<float>(more.uz[i]);
  }
}

Vec3 Composition::displacement_at(const Vec3& X) const noexcept {
  Vec3 x = X;
  for (std::size_t k = 0; k < count_; ++k) x += steps_[k].scale * field(steps_[k]).displacement(x);
  return x - X;
}

}  // namespace brachy
