#include "core/heterogeneous/heterogeneous_deformation.h"

#include <algorithm>
#include <cassert>

namespace brachy {
namespace {

BlockField blocks_for(const Tissue& points, const ScalarKernels& kernels, std::size_t tissue,
                      const BlockField::Options& options) {
  return {points, kernels.psi, kernels.supports[tissue], options};
}

CompactBlocks blocks_for(const Tissue& points, const CompactKernels& kernels, std::size_t tissue,
                         const BlockField::Options& options) {
  return {points, kernels.kernels[tissue], options};
}

double lone_compliance(const ScalarKernels& kernels) {
  return kernels.value(0, Vec3::Zero());
}

double lone_compliance(const CompactKernels& kernels) {
  return kernels.value(0, Vec3::Zero())(0, 0);
}

// So that a lone landmark in tissue 0 has this stiffness.
template <class Kernels>
double scale_to(double landmark_stiffness, const Kernels& kernels) {
  return landmark_stiffness > 0 ? landmark_stiffness * lone_compliance(kernels) : 1;
}

}  // namespace

template <class Kernels>
HeterogeneousDeformation<Kernels>::Part::Part(TissuePart points, const Kernels& kernels, std::size_t tissue,
                                              const BlockField::Options& options)
    : where(std::move(points)), blocks(blocks_for(where.points, kernels, tissue, options)) {
  landmarks.reserve(options.max_landmarks);
  positions.reserve(options.max_landmarks);
  weights.reserve(options.max_landmarks);
}

template <class Kernels>
HeterogeneousDeformation<Kernels>::HeterogeneousDeformation(const Tissue& tissue, TissueModel<Kernels> model,
                                                            const BlockField::Options& options,
                                                            double landmark_stiffness_n_per_mm)
    : model_(std::move(model)),
      options_(options),
      system_(model_, options.max_landmarks, options.target),
      cells_(model_, options.target, options.max_landmarks),
      force_scale_(scale_to(landmark_stiffness_n_per_mm, model_.kernels)),
      is_touched_(tissue.blocks.size()),
      displacements_(tissue.blocks.size()) {
  BlockField::Options direct = options;
  direct.max_condensed_bytes = 0;
  std::vector<TissuePart> points = parts_of(tissue, model_.membership);
  for (std::size_t m = 0; m < points.size(); ++m)
    parts_.push_back(std::make_unique<Part>(std::move(points[m]), model_.kernels, m, direct));
  const std::size_t n = options.max_landmarks;
  for (auto* v : {&placed_, &positions_, &displacements_wanted_, &weights_}) v->reserve(n);
  shares_.reserve(n * model_.membership.tissues());
  touched_.reserve(tissue.blocks.size());
}

template <class Kernels>
FactorStatus HeterogeneousDeformation<Kernels>::place(std::span<const Vec3> positions,
                                                      std::span<const double> /*cores*/) noexcept {
  if (is_factored_ && std::ranges::equal(positions, placed_)) return {};
  const FactorStatus status = system_.factorize(positions);
  is_factored_ = static_cast<bool>(status);
  if (!status) return status;
  condition_ = system_.condition();
  placed_.assign(positions.begin(), positions.end());
  return {};
}

template <class Kernels>
FactorStatus HeterogeneousDeformation<Kernels>::update(std::span<const Vec3> positions,
                                                       std::span<const Vec3> displacements,
                                                       std::span<const double> /*cores*/) noexcept {
  if (const FactorStatus status = place(positions); !status) return status;
  const bool same_positions = has_field_ && std::ranges::equal(positions, positions_);
  if (same_positions && std::ranges::equal(displacements, displacements_wanted_)) {
    evaluation_ = Evaluation::kIdle;
    return {};
  }
  if (!same_positions) {
    has_field_ = true;
    positions_.assign(positions.begin(), positions.end());
    shares_.assign(system_.shares().begin(), system_.shares().end());
    share_out_landmarks();
  }
  displacements_wanted_.assign(displacements.begin(), displacements.end());
  weights_.resize(positions_.size());
  system_.solve(displacements_wanted_, weights_);
  evaluate();
  evaluation_ = Evaluation::kDirect;
  return {};
}

template <class Kernels>
void HeterogeneousDeformation<Kernels>::reactions(std::span<const Vec3> displacements,
                                                  std::span<Vec3> forces) noexcept {
  assert(is_factored_);
  system_.solve(displacements, forces);
  for (Vec3& f : forces) f *= force_scale_;
}

template <class Kernels>
void HeterogeneousDeformation<Kernels>::axial_stiffness(std::size_t first, std::span<const Vec3> axes,
                                                        Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  assert(is_factored_);
  system_.project_inverse(first, axes, H);
  H *= force_scale_;
}

template <class Kernels>
void HeterogeneousDeformation<Kernels>::rescale(double scale) noexcept {
  for (auto* vectors : {&weights_, &displacements_wanted_})
    for (Vec3& v : *vectors) v *= scale;
  evaluate();
}

template <class Kernels>
double HeterogeneousDeformation<Kernels>::total_force_n() const {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& w : weights_) sum += w;
  return force_scale_ * sum.norm();
}

template <class Kernels>
void HeterogeneousDeformation<Kernels>::share_out_landmarks() noexcept {
  const std::size_t M = parts_.size();
  for (std::size_t m = 0; m < M; ++m) {
    Part& part = *parts_[m];
    part.landmarks.clear();
    part.positions.clear();
    for (std::uint32_t i = 0; i < positions_.size(); ++i) {
      if (shares_[i * M + m] == 0) continue;
      part.landmarks.push_back(i);
      part.positions.push_back(positions_[i]);
    }
    part.blocks.set_landmarks(part.positions);
  }
}

template <class Kernels>
void HeterogeneousDeformation<Kernels>::evaluate() noexcept {
  const std::size_t M = parts_.size();
  for (const std::uint32_t b : touched_) is_touched_[b] = false;
  touched_.clear();
  for (std::size_t m = 0; m < M; ++m) {
    Part& part = *parts_[m];
    part.weights.clear();
    for (const std::uint32_t i : part.landmarks) part.weights.push_back(shares_[i * M + m] * weights_[i]);
    part.blocks.evaluate(part.weights);
    add(part);
  }
  std::ranges::sort(touched_);
}

// u += w_m u_m in the blocks that tissue m's landmarks reach.
template <class Kernels>
void HeterogeneousDeformation<Kernels>::add(const Part& part) noexcept {
  for (const std::uint32_t k : part.blocks.touched()) {
    const std::uint32_t b = part.where.block_of[k];
    BlockDisplacement<float>& u = displacements_[b];
    if (!is_touched_[b]) {
      is_touched_[b] = true;
      touched_.push_back(b);
      u = {};
    }
    const BlockDisplacement<float>& u_m = part.blocks.displacement(k);
    const float* w = &part.where.shares[k * Tissue::kBlockSize];
    for (std::size_t i = 0; i < Tissue::kBlockSize; ++i) {
      u.ux[i] += w[i] * u_m.ux[i];
      u.uy[i] += w[i] * u_m.uy[i];
      u.uz[i] += w[i] * u_m.uz[i];
    }
  }
}

template class HeterogeneousDeformation<ScalarKernels>;
template class HeterogeneousDeformation<CompactKernels>;

}  // namespace brachy
