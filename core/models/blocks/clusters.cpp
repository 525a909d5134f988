#include "core/models/blocks/clusters.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "core/base/work_budget.h"

namespace brachy {
namespace {

constexpr std::size_t kMaxDepth = 32;  // 2³² clusters are more than any tissue has

bool reaches(const Vec3& landmark, double support_radius, const Vec3& min, const Vec3& max) {
  return (min - landmark).cwiseMax(landmark - max).cwiseMax(0.0).squaredNorm() <
         support_radius * support_radius;
}

LocalBox box_of(const BlockPoints<float>& points, std::size_t first, std::size_t count) {
  LocalBox box;
  const float* planes[3] = {points.x + first, points.y + first, points.z + first};
  for (int k = 0; k < 3; ++k) {
    const auto [min, max] = std::minmax_element(planes[k], planes[k] + count);
    box.min[k] = *min;
    box.max[k] = *max;
  }
  return box;
}

}  // namespace

Clusters::Clusters(const Tissue& tissue, double support_radius, std::size_t capacity)
    : tissue_(tissue), support_radius_(support_radius), capacity_(capacity) {
  nodes_.emplace_back();  // so that 0 can mean "no child"
  std::size_t surface_blocks = 0;
  while (surface_blocks < tissue.blocks.size() && tissue.blocks[surface_blocks].first < tissue.surface_count)
    ++surface_blocks;
  if (surface_blocks > 0) roots_.push_back(build(0, surface_blocks));
  if (surface_blocks < tissue.blocks.size()) roots_.push_back(build(surface_blocks, tissue.blocks.size()));

  points_.resize(tissue.blocks.size());
  block_boxes_.resize(tissue.blocks.size());
  group_boxes_.resize(kGroupsInBlock * tissue.blocks.size());
  for (Cluster& cluster : clusters_) {
    double diagonals = 0;
    for (std::size_t b = cluster.first_block; b < cluster.first_block + cluster.block_count; ++b) {
      const BlockPoints<double> exact = exact_points(b, cluster.centre);
      for (std::size_t i = 0; i < Tissue::kBlockSize; ++i) {
        points_[b].x[i] = static_cast<float>(exact.x[i]);
        points_[b].y[i] = static_cast<float>(exact.y[i]);
        points_[b].z[i] = static_cast<float>(exact.z[i]);
      }
      block_boxes_[b] = box_of(points_[b], 0, Tissue::kBlockSize);
      for (std::size_t g = 0; g < kGroupsInBlock; ++g)
        group_boxes_[b * kGroupsInBlock + g] = box_of(points_[b], g * kGroupSize, kGroupSize);
      diagonals += (tissue.blocks[b].max - tissue.blocks[b].min).norm();
    }
    cluster.is_dense = diagonals < cluster.block_count * SpeedThresholds::kDenseDiagonal * support_radius;
  }
  scratch_.resize((kMaxDepth + 1) * capacity);
  reached_.reserve(clusters_.size());
  indices_.reserve(clusters_.size() * capacity);
}

std::uint32_t Clusters::build(std::size_t first_block, std::size_t last_block) {
  const auto id = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  const std::size_t count = last_block - first_block;
  if (count <= kBlocks) {
    node.min = tissue_.blocks[first_block].min;
    node.max = tissue_.blocks[first_block].max;
    for (std::size_t b = first_block; b < last_block; ++b) {
      node.min = node.min.cwiseMin(tissue_.blocks[b].min);
      node.max = node.max.cwiseMax(tissue_.blocks[b].max);
    }
    node.cluster = static_cast<std::uint32_t>(clusters_.size());
    clusters_.push_back({static_cast<std::uint32_t>(first_block), static_cast<std::uint32_t>(count),
                         0.5 * (node.min + node.max), node.min, node.max, false});
  } else {
    const std::size_t middle = first_block + std::bit_ceil(count) / 2;
    node.left = build(first_block, middle);
    node.right = build(middle, last_block);
    node.min = nodes_[node.left].min.cwiseMin(nodes_[node.right].min);
    node.max = nodes_[node.left].max.cwiseMax(nodes_[node.right].max);
  }
  nodes_[id] = node;
  return id;
}

BlockPoints<double> Clusters::exact_points(std::size_t block, const Vec3& centre) const noexcept {
  BlockPoints<double> X;
  const Block& b = tissue_.blocks[block];
  for (std::size_t i = 0; i < Tissue::kBlockSize; ++i) {
    const Vec3 x = (tissue_.rest_vertices[b.first + (i < b.count ? i : 0)] - centre) / support_radius_;
    X.x[i] = x.x();
    X.y[i] = x.y();
    X.z[i] = x.z();
  }
  return X;
}

void Clusters::find(std::span<const Vec3> positions) noexcept {
  positions_ = positions;
  reached_.clear();
  indices_.clear();
  const std::span<std::uint32_t> all(scratch_.data(), positions.size());
  std::iota(all.begin(), all.end(), 0u);
  for (const std::uint32_t root : roots_) find_below(root, all, 1);
}

void Clusters::find_below(std::uint32_t node, std::span<const std::uint32_t> candidates,
                          std::size_t depth) noexcept {
  const Node& n = nodes_[node];
  std::uint32_t* kept = scratch_.data() + depth * capacity_;
  std::size_t count = 0;
  for (const std::uint32_t j : candidates) {
    kept[count] = j;
    count += reaches(positions_[j], support_radius_, n.min, n.max);
  }
  if (count == 0) return;
  if (n.left) {
    find_below(n.left, {kept, count}, depth + 1);
    find_below(n.right, {kept, count}, depth + 1);
    return;
  }
  reached_.push_back(
      {n.cluster, static_cast<std::uint32_t>(indices_.size()), static_cast<std::uint32_t>(count)});
  indices_.insert(indices_.end(), kept, kept + count);
}

}  // namespace brachy
