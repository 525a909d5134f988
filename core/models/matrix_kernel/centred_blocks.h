#pragma once

#include <cstdint>
#include <span>
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

/// Up to Tissue::kBlockSize points in the same form, about the first of them, and the box about them.
struct CentredPoints {
  explicit CentredPoints(std::span<const Vec3> X) : centre(X[0]) {
    box.count = static_cast<std::uint32_t>(X.size());
    box.min = box.max = X[0];
    for (std::size_t i = 0; i < Tissue::kBlockSize; ++i) {
      const Vec3& at = X[i < X.size() ? i : 0];
      box.min = box.min.cwiseMin(at);
      box.max = box.max.cwiseMax(at);
      local.x[i] = static_cast<float>(at.x() - centre.x());
      local.y[i] = static_cast<float>(at.y() - centre.y());
      local.z[i] = static_cast<float>(at.z() - centre.z());
    }
  }

  Vec3 centre;  ///< mm
  BlockPoints<float> local;
  Block box;
};

inline Vec3 displacement_in(const BlockDisplacement<float>& u, std::size_t i) {
  return Eigen::Vector3f(u.ux[i], u.uy[i], u.uz[i]).cast<double>();
}

}  // namespace brachy
