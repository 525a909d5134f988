#include "core/models/scalar_kernel/scalar_composition.h"

#include <algorithm>
#include <cassert>

#include <numeric>

#include "core/injectivity/injectivity_search.h"
#include "core/models/blocks/block_field.h"

namespace brachy {
namespace {

constexpr std::size_t kPoints = Tissue::kBlockSize;
constexpr double kHardlyStrained = 0.9;  // above this a bound of the determinant replaces it

constexpr double kFarAway = 1e15;  // support radii: reaches nothing; its square is still finite

template <class T>
void add(const BlockDisplacement<T>& more, BlockDisplacement<float>& u) {
  for (std::size_t i = 0; i < kPoints; ++i) {
    u.ux[i] += static_cast<float>(more.ux[i]);
    u.uy[i] += static_cast<float>(more.uy[i]);
    u.uz[i] += static_cast<float>(more.uz[i]);
  }
}

}  // namespace

ScalarComposition::ScalarComposition(const Tissue& tissue, const Kernel& kernel, double support_radius,
                                     SimdTarget target, std::size_t max_landmarks, std::size_t max_steps)
    : Composition(tissue.blocks.size()),
      tissue_(tissue),
      kernel_(kernel),
      support_radius_(support_radius),
      loops_(block_kernels(kernel, target)),
      system_(kernel, support_radius, static_cast<int>(max_landmarks), target),
      cells_(kernel, support_radius, target, max_landmarks),
      steps_(max_steps),
      is_touched_(tissue.blocks.size()),
      determinants_(tissue.blocks.size() * kPoints) {
  scratch_.all.resize(max_landmarks);
  scratch_.near.resize(max_landmarks);
  scratch_.in_double.resize(max_landmarks);
  scratch_.in_single.resize(max_landmarks);
  scratch_.chosen.resize(max_landmarks + BlockKernels::kSpare);
  for (auto* plane : {&scratch_.x, &scratch_.y, &scratch_.z}) plane->resize(max_landmarks + kGroupSize);
  for (Step& step : steps_) {
    step.positions.reserve(max_landmarks);
    step.weights.reserve(max_landmarks);
  }
  touched_.reserve(tissue.blocks.size());
  std::iota(scratch_.all.begin(), scratch_.all.end(), 0u);
}

double ScalarComposition::begin(std::span<const Vec3> positions,
                                std::span<const Vec3> displacements) noexcept {
  begin_way(positions, displacements);
  count_ = 0;
  return 1;
}

void ScalarComposition::move_landmarks() noexcept {
  assert(count_ < steps_.size());
  Step& step = steps_[count_];
  step.positions.clear();
  for (std::size_t i = 0; i < positions_.size(); ++i)
    step.positions.push_back(positions_[i] + reached() * landmark_displacements_[i]);
}

bool ScalarComposition::next() noexcept {
  if (reached() >= 1 || count_ == steps_.size()) return false;
  move_landmarks();
  Step& step = steps_[count_];
  FactorStatus status = system_.factorize(step.positions);
  if (status) status = FactorStatus::of_condition(system_.condition());
  if (!status) return false;
  step.weights.resize(positions_.size());
  system_.solve(landmark_displacements_, step.weights);
  cells_.set_field(field(step));
  return true;
}

void ScalarComposition::accept(double scale, const Vec3* /*weakest*/) noexcept {
  steps_[count_].scale = scale;
  ++count_;
  go_on(scale);
}

void ScalarComposition::evaluate(std::uint64_t) noexcept {
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
void ScalarComposition::apply(const Step& step, std::uint32_t b) noexcept {
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
  const Cell cell = Cell::around(min, max);
  CellBounds bounds;
  const std::size_t count =
      cells_.narrow(cell, {scratch_.all.data(), step.positions.size()}, scratch_.near.data(), bounds);
  if (count == 0) return;
  is_touched_[b] = 1;
  const std::span<const std::uint32_t> near(scratch_.near.data(), count);

  float* det_product = &determinants_[b * kPoints];
  if (const double bound = InjectivitySearch::bound_by_norms(bounds, step.scale); bound > kHardlyStrained)
    for (std::size_t i = 0; i < kPoints; ++i) det_product[i] *= static_cast<float>(bound);
  else
    multiply_determinants(step, b, cell, near, det_product);
  add_displacement(step, b, cell, near);
}

void ScalarComposition::multiply_determinants(const Step& step, std::uint32_t b, const Cell& cell,
                                              std::span<const std::uint32_t> sources,
                                              float* product) noexcept {
  const Block& block = tissue_.blocks[b];
  const BlockDisplacement<float>& u = displacements_[b];
  for (std::size_t half = 0; half < kPoints; half += CellPoints::kCount) {
    CellPoints X{};
    for (std::size_t i = 0; i < CellPoints::kCount; ++i) {
      const std::size_t k = half + i < block.count ? half + i : 0;
      X.set(i, tissue_.rest_vertices[block.first + k] + Vec3(u.ux[k], u.uy[k], u.uz[k]) - cell.centre);
    }
    CellGradients A;
    cells_.gradients(cell, sources, CellBounds{}, X, A);
    alignas(64) float det[CellPoints::kCount];
    cells_.loops().determinants(A, static_cast<float>(step.scale), det);
    for (std::size_t i = 0; i < CellPoints::kCount; ++i) product[half + i] *= det[i];
  }
}

// In double where BlockField would.
void ScalarComposition::add_displacement(const Step& step, std::uint32_t b, const Cell& cell,
                                         std::span<const std::uint32_t> sources) noexcept {
  double size = 0;
  for (const std::uint32_t j : sources) size += step.scale * step.weights[j].norm();
  if (size * BlockField::kFloatErrorPerWeight > BlockField::kFloatError)
    return add_in_double(step, b, cell, sources);

  const double inverse = 1 / support_radius_;
  const std::size_t padded = (sources.size() + kGroupSize - 1) / kGroupSize * kGroupSize;
  for (std::size_t j = 0; j < padded; ++j) {
    const bool is_one = j < sources.size();
    const Vec3 p =
        is_one ? Vec3(inverse * (step.positions[sources[j]] - cell.centre)) : Vec3::Constant(kFarAway);
    scratch_.x[j] = static_cast<float>(p.x());
    scratch_.y[j] = static_cast<float>(p.y());
    scratch_.z[j] = static_cast<float>(p.z());
    if (!is_one) continue;
    const Eigen::Vector3f w = (step.scale * step.weights[sources[j]]).cast<float>();
    scratch_.in_single[j] = {scratch_.x[j], scratch_.y[j], scratch_.z[j], w.x(), w.y(), w.z()};
  }
  const auto half = static_cast<float>(inverse * cell.half);
  const LocalBox box{{-half, -half, -half}, {half, half, half}};
  const BlockPoints<float> X = moved_points<float>(b, cell.centre);
  BlockDisplacement<float> more;
  loops_.direct_by_block(X, &box, {scratch_.x.data(), scratch_.y.data(), scratch_.z.data(), padded},
                         scratch_.in_single.data(), scratch_.chosen.data(), more);
  add(more, displacements_[b]);
}

void ScalarComposition::add_in_double(const Step& step, std::uint32_t b, const Cell& cell,
                                      std::span<const std::uint32_t> sources) noexcept {
  const double inverse = 1 / support_radius_;
  for (std::size_t j = 0; j < sources.size(); ++j) {
    const Vec3 p = inverse * (step.positions[sources[j]] - cell.centre),
               w = step.scale * step.weights[sources[j]];
    scratch_.in_double[j] = {p.x(), p.y(), p.z(), w.x(), w.y(), w.z()};
  }
  const BlockPoints<double> X = moved_points<double>(b, cell.centre);
  BlockDisplacement<double> more;
  for (std::size_t first = 0; first < kPoints; first += kGroupSize)
    loops_.direct_double(X, first, scratch_.in_double.data(), scratch_.all.data(), sources.size(), more);
  add(more, displacements_[b]);
}

// A block's points where earlier steps have moved them, about `centre`, in support radii.
template <class T>
BlockPoints<T> ScalarComposition::moved_points(std::uint32_t b, const Vec3& centre) const noexcept {
  const Block& block = tissue_.blocks[b];
  const BlockDisplacement<float>& u = displacements_[b];
  const double inverse = 1 / support_radius_;
  BlockPoints<T> X;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const std::size_t k = i < block.count ? i : 0;
    const Vec3 x =
        inverse * (tissue_.rest_vertices[block.first + k] + Vec3(u.ux[k], u.uy[k], u.uz[k]) - centre);
    X.x[i] = static_cast<T>(x.x());
    X.y[i] = static_cast<T>(x.y());
    X.z[i] = static_cast<T>(x.z());
  }
  return X;
}

Vec3 ScalarComposition::displacement_at(const Vec3& X) const noexcept {
  Vec3 x = X;
  for (std::size_t k = 0; k < count_; ++k) x += steps_[k].scale * field(steps_[k]).displacement(x);
  return x - X;
}

}  // namespace brachy
