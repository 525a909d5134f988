#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/models/blocks/block_kernels.h"

namespace brachy {

/// The tissue's blocks in clusters of up to kBlocks neighbours, with single-precision coordinates about the cluster's
/// centre, and the search for the clusters that a set of landmarks reaches.
///
/// The blocks stand in the order of a k-d tree (Tissue), so the tree is implicit: a run of blocks splits at the largest
/// power of two below its length. Points outside every support are never visited.
/// Threads: const functions from any; find from one. Real-time: no allocation after construction.
class Clusters {
 public:
  static constexpr std::size_t kBlocks = 16;

  struct Cluster {
    std::uint32_t first_block = 0, block_count = 0;
    Vec3 centre, min, max;  ///< mm
    bool is_dense = false;  ///< its blocks are so small beside the support that culling groups would not pay
  };

  /// A cluster and the landmarks whose support reaches its box, ascending.
  struct Reached {
    std::uint32_t cluster = 0;
    std::uint32_t first = 0, count = 0;  ///< in landmark_indices()
  };

  /// `support_radius` a in mm; `capacity`: the most landmarks that find is called with. The tissue must outlive this.
  Clusters(const Tissue& tissue, double support_radius, std::size_t capacity);

  /// Finds the clusters that the landmarks at `positions` reach: the result is in reached() and landmark_indices().
  void find(std::span<const Vec3> positions) noexcept;
  std::span<const Reached> reached() const { return {reached_.data(), reached_.size()}; }
  std::span<const std::uint32_t> landmark_indices() const { return {indices_.data(), indices_.size()}; }

  const Cluster& cluster(std::size_t c) const { return clusters_[c]; }
  std::size_t size() const { return clusters_.size(); }
  const BlockPoints<float>& points(std::size_t block) const { return points_[block]; }
  /// Boxes of a block's groups, kGroupsInBlock of them, and of the block as a whole.
  const LocalBox* group_boxes(std::size_t block) const { return &group_boxes_[block * kGroupsInBlock]; }
  const LocalBox& block_box(std::size_t block) const { return block_boxes_[block]; }
  /// The same coordinates in double, computed again.
  BlockPoints<double> exact_points(std::size_t block, const Vec3& centre) const noexcept;

 private:
  struct Node {
    Vec3 min, max;
    std::uint32_t left = 0, right = 0;  // 0: a leaf
    std::uint32_t cluster = 0;          // of a leaf
  };
  std::uint32_t build(std::size_t first_block, std::size_t last_block);
  void find_below(std::uint32_t node, std::span<const std::uint32_t> candidates, std::size_t depth) noexcept;

  const Tissue& tissue_;
  double support_radius_;
  std::size_t capacity_;
  std::vector<Cluster> clusters_;
  std::vector<BlockPoints<float>> points_;
  std::vector<LocalBox> group_boxes_, block_boxes_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> roots_;

  std::span<const Vec3> positions_;  // during find
  std::vector<std::uint32_t> scratch_;
  std::vector<Reached> reached_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace brachy
