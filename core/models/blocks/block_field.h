#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/kernels/kernels.h"
#include "core/models/blocks/block_kernels.h"
#include "core/models/blocks/clusters.h"

namespace brachy {

/// Counts of the last evaluate; no times.
struct FieldStatistics {
  std::uint32_t touched_blocks = 0;    ///< some support reaches them
  std::uint32_t condensed_blocks = 0;  ///< of these, evaluated by their condensed columns
  std::uint32_t double_groups = 0;     ///< groups of points summed in double because their weights are large
  std::uint64_t pairs = 0;             ///< points × landmarks summed directly
};

/// The displacement field at all points of a tissue, block by block: only blocks that a landmark's support reaches
/// are visited, and each group of kGroupSize neighbours only with the landmarks that reach it. Two ways for a block:
///
/// direct     u = Σ_j ψ(|X − p_j|/a) w_j, vectorised over the points of a group;
/// condensed  u = Σ_k B_k d_k with B = Ψ K⁻¹ restricted to the columns of the landmarks that move, once condense has
///            built them: a few multiply-adds a point while the landmarks' rest positions do not change.
///
/// Weights are double. Sums are float about the cluster's centre; where a group's Σ|w| is so large that float could be
/// wrong by more than kFloatError, the group is summed in double. The order of a sum is that of the landmarks, for
/// every point and any number of threads: results are bitwise the same on one SIMD target.
/// Threads: one caller; inside, OpenMP over clusters when `threads` > 1 and the work is worth it. Real-time: with one
/// thread no allocation after construction.
class BlockField {
 public:
  struct Options {
    SimdTarget target = best_simd_target();
    int threads = 1;
    std::size_t max_landmarks = 64;
    std::size_t max_condensed_bytes = std::size_t{64} << 20;  ///< memory for condensed columns
  };
  static constexpr double kFloatError = 1e-5;  ///< mm
  /// A float sum of ψ w is off by at most about this share of Σ|w|: six roundings of 2⁻²⁴ in ψ and its distance, one in
  /// the product, and those of the sum (block_field_test measures it).
  static constexpr double kFloatErrorPerWeight = 2.5e-7;

  /// `support_radius` a in mm. The tissue must outlive the field.
  BlockField(const Tissue& tissue, Kernel kernel, double support_radius, const Options& options);

  /// New rest positions (n ≤ max_landmarks, mm): finds the clusters they reach and drops condensed columns.
  void set_landmarks(std::span<const Vec3> positions) noexcept;

  /// u at every point in reach, from the landmarks' `weights` (n, mm); blocks that are condensed take the
  /// displacements `moving` (m, mm) of begin_condensing's columns instead. Afterwards touched() lists the blocks some
  /// support reaches, ascending, and displacement(b) holds block b's.
  void evaluate(std::span<const Vec3> weights, std::span<const Vec3> moving = {}) noexcept;

  /// Whether m columns for all touched blocks fit into the memory set aside.
  bool can_condense(std::size_t m) const noexcept;
  /// Starts building condensed columns. `inverse_columns`: n × m, row j the shares of landmark j in each of the m
  /// columns of K⁻¹; must stay valid until the landmarks change.
  void begin_condensing(std::span<const double> inverse_columns, std::size_t m) noexcept;
  /// Builds columns for more blocks, up to about `budget` pairs (points × landmarks × a factor for m); false
  /// once all are built.
  bool condense(std::uint64_t budget) noexcept;

  std::span<const std::uint32_t> touched() const { return {touched_.data(), touched_.size()}; }
  const BlockDisplacement<float>& displacement(std::size_t block) const { return displacements_[block]; }
  const FieldStatistics& statistics() const { return statistics_; }
  /// Pairs in reach of the landmarks at cluster resolution: an upper bound of a direct evaluation's work.
  std::uint64_t reachable_pairs() const { return reachable_pairs_; }
  std::uint64_t reachable_points() const { return reachable_points_; }
  SimdTarget target() const { return options_.target; }

 private:
  struct ClusterResult {
    std::uint32_t touched_mask = 0, double_groups = 0, condensed_blocks = 0;
    std::uint64_t pairs = 0;
  };
  /// A cluster's landmarks in its coordinates; one for each thread.
  struct LocalLandmarks {
    explicit LocalLandmarks(std::size_t capacity);
    LandmarkPlanes planes() const { return {x.data(), y.data(), z.data(), count}; }
    std::size_t count = 0;
    std::vector<float> x, y, z;
    std::vector<LocalLandmark<float>> landmarks;
    std::vector<LocalLandmark<double>> exact;
    std::vector<double> size;  // |w|, mm
    std::vector<std::uint32_t> chosen;
    bool may_need_double = false;  // Σ|w| of all of them is large
  };

  ClusterResult evaluate_cluster(const Clusters::Reached& reached, std::span<const Vec3> weights,
                                 LocalLandmarks& local) noexcept;
  void localize(const Clusters::Reached& reached, std::span<const Vec3> weights,
                LocalLandmarks& local) const noexcept;
  std::uint32_t sum_large_groups_in_double(std::size_t block, const Vec3& centre,
                                           LocalLandmarks& local) noexcept;
  void condense_block(std::size_t block, const Clusters::Reached& reached) noexcept;

  const Tissue& tissue_;
  double support_radius_;
  Options options_;
  const BlockKernels& loops_;
  Clusters clusters_;
  std::vector<Vec3> positions_;
  std::uint64_t reachable_pairs_ = 0, reachable_points_ = 0;

  std::vector<LocalLandmarks> local_;
  std::vector<ClusterResult> results_;
  std::vector<std::uint32_t> touched_;
  std::vector<BlockDisplacement<float>> displacements_;
  FieldStatistics statistics_;

  struct Condensed {
    std::span<const double> inverse_columns;
    std::size_t m = 0;
    std::size_t next_cluster = 0;               // of reached(): where building continues
    std::uint32_t next_block = 0;               // within that cluster
    std::vector<std::int32_t> column_of_block;  // slot in columns, or why it has none
    std::vector<std::uint32_t> blocks;          // that condense has processed
    std::size_t slots = 0;
    std::vector<float> columns;  // slots × m × kBlockSize
    std::vector<double> build;   // m × kBlockSize
    std::vector<float> moving;   // m × 3
  };
  Condensed condensed_;
};

}  // namespace brachy
