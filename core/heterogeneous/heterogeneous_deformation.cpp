#include "core/heterogeneous/heterogeneous_deformation.h"

#include <algorithm>
#include <limits>

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
                                                            const BlockField::Options& options)
    : model_(std::move(model)),
      options_(options),
      system_(model_, options.max_landmarks),
      cells_(model_, options.target, options.max_landmarks),
      is_touched_(tissue.blocks.size()),
      displacements_(tissue.blocks.size()) {
  BlockField::Options direct = options;
  direct.max_condensed_bytes = 0;
  std::vector<TissuePart> points = parts_of(tissue, model_.membership);
  for (std::size_t m = 0; m < points.size(); ++m)
    parts_.push_back(std::make_unique<Part>(std::move(points[m]), model_.kernels, m, direct));
  const std::size_t n = options.max_landmarks;
  for (auto* v : {&positions_, &displacements_wanted_, &weights_}) v->reserve(n);
  shares_.reserve(n * model_.membership.tissues());
  touched_.reserve(tissue.blocks.size());
}

template <class Kernels>
FactorStatus HeterogeneousDeformation<Kernels>::update(std::span<const Vec3> positions,
                                                       std::span<const Vec3> displacements) noexcept {
  const bool same_positions = is_factored_ && std::ranges::equal(positions, positions_);
  if (same_positions && std::ranges::equal(displacements, displacements_wanted_)) {
    evaluation_ = Evaluation::kIdle;
    return {};
  }
  if (!same_positions) {
    const FactorStatus status = system_.factorize(positions);
    is_factored_ = static_cast<bool>(status);
    if (!status) return status;
    condition_ = system_.condition();
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
void HeterogeneousDeformation<Kernels>::rescale(double scale) noexcept {
  for (auto* vectors : {&weights_, &displacements_wanted_})
    for (Vec3& v : *vectors) v *= scale;
  evaluate();
}

template <class Kernels>
double HeterogeneousDeformation<Kernels>::total_force_n() const {
  if constexpr (Kernels::kRows == 1) return std::numeric_limits<double>::quiet_NaN();
  Vec3 sum = Vec3::Zero();
  for (const Vec3& f : weights_) sum += f;
  return sum.norm();
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
