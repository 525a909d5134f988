#pragma once

#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/models/blocks/block_kernels.h"

namespace brachy {

/// A tissue's blocks in the form of near_loops.h: points about the middle of their block, mm.
struct CentredBlocks {
  explicit CentredBlocks(const Tissue& tissue) {
    for (const Block& block : tissue.blocks) {
      centres.push_back(0.5 * (block.min + block.max));
      BlockPoints<float>& local = points.emplace_back();
      for (std::size_t i = 0; i < Tissue::kBlockSize; ++i) {
        const Vec3 x = tissue.rest_vertices[block.first + (i < block.count ? i : 0)] - centres.back();
        local.x[i] = static_cast<float>(x.x());
        local.y[i] = static_cast<float>(x.y());
        local.z[i] = static_cast<float>(x.z());
      }
    }
  }

  std::vector<Vec3> centres;  ///< mm
  std::vector<BlockPoints<float>> points;
};

}  // namespace brachy
