#include "core/models/blended/tissue_part.h"

#include <algorithm>
#include <array>

namespace brachy {

std::vector<TissuePart> parts_of(const Tissue& tissue, const Membership& membership) {
  const std::size_t M = membership.tissues();
  std::vector<TissuePart> parts(M);
  std::vector<std::array<float, Tissue::kBlockSize>> of_block(M);
  std::vector<double> w(M);
  for (std::uint32_t b = 0; b < tissue.blocks.size(); ++b) {
    const Block& block = tissue.blocks[b];
    for (auto& shares : of_block) shares.fill(0);
    for (std::uint32_t i = 0; i < block.count; ++i) {
      membership.shares(tissue.rest_vertices[block.first + i], w);
      for (std::size_t m = 0; m < M; ++m) of_block[m][i] = static_cast<float>(w[m]);
    }
    for (std::size_t m = 0; m < M; ++m) {
      if (std::ranges::count(of_block[m], 0.0f) == Tissue::kBlockSize) continue;
      TissuePart& part = parts[m];
      auto& vertices = part.points.rest_vertices;
      part.points.blocks.push_back(
          {static_cast<std::uint32_t>(vertices.size()), block.count, block.min, block.max});
      const auto first = tissue.rest_vertices.begin() + block.first;
      vertices.insert(vertices.end(), first, first + block.count);
      if (block.first < tissue.surface_count) part.points.surface_count = vertices.size();
      part.block_of.push_back(b);
      part.shares.insert(part.shares.end(), of_block[m].begin(), of_block[m].end());
    }
  }
  return parts;
}

}  // namespace brachy
