#include "core/models/blended/blended_kernel_field.h"

#include <algorithm>

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
BlendedKernelField<Kernels>::Part::Part(TissuePart points, const Kernels& kernels, std::size_t tissue,
                                        const BlockField::Options& options)
    : where(std::move(points)), blocks(blocks_for(where.points, kernels, tissue, options)) {
  landmarks.reserve(options.max_landmarks);
  positions.reserve(options.max_landmarks);
  weights.reserve(options.max_landmarks);
}

template <class Kernels>
BlendedKernelField<Kernels>::BlendedKernelField(const Tissue& tissue, TissueModel<Kernels> model,
                                                const BlockField::Options& options,
                                                double landmark_stiffness_n_per_mm)
    : TissueField({.max_landmarks = options.max_landmarks,
                   .force_scale = scale_to(landmark_stiffness_n_per_mm, model.kernels)}),
      model_(std::move(model)),
      system_(model_, options.max_landmarks, options.target),
      cells_(model_, options.target, options.max_landmarks),
      is_touched_(tissue.blocks.size()),
      displacements_(tissue.blocks.size()) {
  BlockField::Options direct = options;
  direct.max_condensed_bytes = 0;
  std::vector<TissuePart> points = parts_of(tissue, model_.membership);
  for (std::size_t m = 0; m < points.size(); ++m)
    parts_.push_back(std::make_unique<Part>(std::move(points[m]), model_.kernels, m, direct));
  shares_.reserve(options.max_landmarks * model_.membership.tissues());
  touched_.reserve(tissue.blocks.size());
}

template <class Kernels>
FactorStatus BlendedKernelField<Kernels>::do_factorize(const LandmarkSet& landmarks,
                                                       double& condition) noexcept {
  const FactorStatus status = system_.factorize(landmarks.positions);
  condition = system_.condition();
  return status;
}

template <class Kernels>
void BlendedKernelField<Kernels>::do_solve(std::span<const Vec3> displacements,
                                           std::span<Vec3> weights) noexcept {
  system_.solve(displacements, weights);
}

template <class Kernels>
void BlendedKernelField<Kernels>::do_project_inverse(std::size_t first, std::span<const Vec3> axes,
                                                     Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  system_.project_inverse(first, axes, H);
}

template <class Kernels>
Evaluation BlendedKernelField<Kernels>::do_evaluate(bool is_new_set, std::span<Vec3> weights) noexcept {
  if (is_new_set) {
    shares_.assign(system_.shares().begin(), system_.shares().end());
    share_out_landmarks();
  }
  system_.solve(displacements(), weights);
  evaluate_parts(weights);
  return Evaluation::kDirect;
}

template <class Kernels>
void BlendedKernelField<Kernels>::do_rescale(double /*scale*/) noexcept {
  evaluate_parts(weights());
}

template <class Kernels>
void BlendedKernelField<Kernels>::share_out_landmarks() noexcept {
  const std::size_t M = parts_.size();
  for (std::size_t m = 0; m < M; ++m) {
    Part& part = *parts_[m];
    part.landmarks.clear();
    part.positions.clear();
    for (std::uint32_t i = 0; i < positions().size(); ++i) {
      if (shares_[i * M + m] == 0) continue;
      part.landmarks.push_back(i);
      part.positions.push_back(positions()[i]);
    }
    part.blocks.set_landmarks(part.positions);
  }
}

template <class Kernels>
void BlendedKernelField<Kernels>::evaluate_parts(std::span<const Vec3> weights) noexcept {
  const std::size_t M = parts_.size();
  for (const std::uint32_t b : touched_) is_touched_[b] = false;
  touched_.clear();
  for (std::size_t m = 0; m < M; ++m) {
    Part& part = *parts_[m];
    part.weights.clear();
    for (const std::uint32_t i : part.landmarks) part.weights.push_back(shares_[i * M + m] * weights[i]);
    part.blocks.evaluate(part.weights);
    add(part);
  }
  std::ranges::sort(touched_);
}

// u += w_m u_m in the blocks that tissue m's landmarks reach.
template <class Kernels>
void BlendedKernelField<Kernels>::add(const Part& part) noexcept {
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

template class BlendedKernelField<ScalarKernels>;
template class BlendedKernelField<CompactKernels>;

}  // namespace brachy
