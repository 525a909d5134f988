#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/elasticity/compact/compact_kernel.h"
#include "core/geometry/tissue/tissue.h"
#include "core/models/blocks/block_field.h"
#include "core/models/matrix_kernel/centred_blocks.h"
#include "core/models/matrix_kernel/near_loops.h"

namespace brachy {

/// The field of point landmarks at all points of a tissue for one compact kernel, Σ_i C(X − p_i) f_i: what
/// BlockField is to the ψ kernels. A block is summed over the landmarks that reach its box; one that none
/// reaches is left out.
/// Threads: one caller; inside, OpenMP over blocks when `threads` > 1. Real-time: with one thread no allocation after
/// construction.
class CompactBlocks {
 public:
  /// Tissue and kernel must outlive this. Of `options`: target, threads and max_landmarks.
  CompactBlocks(const Tissue& tissue, const CompactKernel& kernel, const BlockField::Options& options);

  /// New rest positions (n ≤ max_landmarks, mm).
  void set_landmarks(std::span<const Vec3> positions) noexcept;
  /// u at every point in reach, from the landmarks' forces (n, N).
  void evaluate(std::span<const Vec3> forces) noexcept;

  std::span<const std::uint32_t> touched() const { return touched_; }  ///< blocks in reach, ascending
  const BlockDisplacement<float>& displacement(std::size_t block) const { return displacements_[block]; }

 private:
  bool reaches(const Vec3& position, const Block& block) const noexcept;
  void evaluate_block(std::uint32_t b, std::span<const Vec3> forces,
                      std::vector<NearSource>& sources) noexcept;

  const Tissue& tissue_;
  double support_, compliance_;
  CompactShape shape_;
  const NearLoops& loops_;
  CentredBlocks blocks_;
  std::vector<Vec3> positions_;
  std::vector<std::uint32_t> touched_;
  std::vector<BlockDisplacement<float>> displacements_;
  std::vector<std::vector<NearSource>> sources_;  // one for each thread
};

}  // namespace brachy
