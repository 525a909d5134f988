#include "core/models/blended/compact_blocks.h"

#include <algorithm>

#include "core/base/share_out.h"
#include "core/models/matrix_kernel/near_field.h"

namespace brachy {

CompactBlocks::CompactBlocks(const Tissue& tissue, const CompactKernel& kernel,
                             const BlockField::Options& options)
    : tissue_(tissue),
      support_(kernel.support()),
      compliance_(kernel.compliance()),
      shape_(shape_of(kernel)),
      loops_(near_loops(options.target)),
      blocks_(tissue),
      displacements_(tissue.blocks.size()),
      sources_(static_cast<std::size_t>(std::max(1, options.threads))) {
  positions_.reserve(options.max_landmarks);
  touched_.reserve(tissue.blocks.size());
  for (auto& sources : sources_) sources.reserve(options.max_landmarks);
}

bool CompactBlocks::reaches(const Vec3& position, const Block& block) const noexcept {
  return block.squared_distance(position) < support_ * support_;
}

void CompactBlocks::set_landmarks(std::span<const Vec3> positions) noexcept {
  positions_.assign(positions.begin(), positions.end());
  touched_.clear();
  for (std::uint32_t b = 0; b < tissue_.blocks.size(); ++b)
    if (std::ranges::any_of(positions_, [&](const Vec3& p) { return reaches(p, tissue_.blocks[b]); }))
      touched_.push_back(b);
}

void CompactBlocks::evaluate(std::span<const Vec3> forces) noexcept {
  share_out(touched_.size(), sources_.size(), [&](std::size_t k, std::size_t thread) {
    evaluate_block(touched_[k], forces, sources_[thread]);
  });
}

void CompactBlocks::evaluate_block(std::uint32_t b, std::span<const Vec3> forces,
                                   std::vector<NearSource>& sources) noexcept {
  sources.clear();
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (!reaches(positions_[i], tissue_.blocks[b])) continue;
    const Eigen::Vector3f p = (positions_[i] - blocks_.centres[b]).cast<float>(),
                          f = (compliance_ * forces[i]).cast<float>();
    sources.push_back({p.x(), p.y(), p.z(), 0, f.x(), f.y(), f.z(), 0});
  }
  displacements_[b] = {};
  loops_.compact(blocks_.points[b], sources.data(), sources.size(), shape_, displacements_[b]);
}

}  // namespace brachy
