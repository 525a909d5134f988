#include "core/models/blocks/block_field.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/base/share_out.h"
#include "core/base/work_budget.h"

namespace brachy {
namespace {

constexpr std::size_t kPoints = Tissue::kBlockSize;

constexpr float kFarAway = 1e15f;  // a landmark there reaches nothing; its square is still finite

constexpr std::int32_t kNotCondensed = -1, kOutOfReach = -2;  // instead of a slot

}  // namespace

BlockField::LocalLandmarks::LocalLandmarks(std::size_t capacity) {
  const std::size_t padded = (capacity + kGroupSize - 1) / kGroupSize * kGroupSize;
  for (auto* plane : {&x, &y, &z}) plane->resize(padded);
  landmarks.resize(capacity);
  exact.resize(capacity);
  size.resize(capacity);
  chosen.resize(capacity + BlockKernels::kSpare);
}

BlockField::BlockField(const Tissue& tissue, Kernel kernel, double support_radius, const Options& options)
    : tissue_(tissue),
      support_radius_(support_radius),
      options_(options),
      loops_(block_kernels(kernel, options.target)),
      clusters_(tissue, support_radius, options.max_landmarks) {
  assert(is_supported(options.target));
  const std::size_t blocks = tissue.blocks.size();
  positions_.reserve(options.max_landmarks);
  local_.assign(static_cast<std::size_t>(std::max(options.threads, 1)),
                LocalLandmarks(options.max_landmarks));
  results_.resize(clusters_.size());
  touched_.reserve(blocks);
  displacements_.resize(blocks);
  condensed_.column_of_block.assign(blocks, kNotCondensed);
  condensed_.blocks.reserve(blocks);
  const std::size_t all_columns = blocks * options.max_landmarks * kPoints;
  condensed_.columns.resize(std::min(all_columns, options.max_condensed_bytes / sizeof(float)));
  condensed_.build.resize(options.max_landmarks * kPoints);
  condensed_.moving.resize(3 * options.max_landmarks);
}

void BlockField::set_landmarks(std::span<const Vec3> positions) noexcept {
  assert(positions.size() <= options_.max_landmarks);
  positions_.assign(positions.begin(), positions.end());
  clusters_.find(positions_);
  reachable_pairs_ = reachable_points_ = 0;
  for (const Clusters::Reached& reached : clusters_.reached()) {
    const std::uint64_t points = clusters_.cluster(reached.cluster).block_count * kPoints;
    reachable_points_ += points;
    reachable_pairs_ += points * reached.count;
  }
  for (const std::uint32_t block : condensed_.blocks) condensed_.column_of_block[block] = kNotCondensed;
  condensed_.blocks.clear();
  condensed_.slots = 0;
  condensed_.m = 0;
}

void BlockField::evaluate(std::span<const Vec3> weights, std::span<const Vec3> moving) noexcept {
  assert(weights.size() == positions_.size());
  assert(condensed_.blocks.empty() || moving.size() == condensed_.m);
  for (std::size_t k = 0; k < moving.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      condensed_.moving[3 * k + static_cast<std::size_t>(axis)] = static_cast<float>(moving[k][axis]);

  const auto reached = clusters_.reached();
  const bool all_condensed = condensed_.m > 0 && condensed_.next_cluster == reached.size();
  const bool worth_threads = (!all_condensed && reachable_pairs_ > SpeedThresholds::kPairsForThreads) ||
                             condensed_.slots * kPoints * condensed_.m > SpeedThresholds::kColumnsForThreads;
  const std::size_t threads = worth_threads ? local_.size() : 1;
  share_out(reached.size(), threads, [&](std::size_t c, std::size_t thread) {
    results_[c] = evaluate_cluster(reached[c], weights, local_[thread]);
  });

  touched_.clear();
  statistics_ = {};
  for (std::size_t c = 0; c < reached.size(); ++c) {
    const ClusterResult& result = results_[c];
    const Clusters::Cluster& cluster = clusters_.cluster(reached[c].cluster);
    for (std::uint32_t i = 0; i < cluster.block_count; ++i)
      if (result.touched_mask >> i & 1) touched_.push_back(cluster.first_block + i);
    statistics_.pairs += result.pairs;
    statistics_.double_groups += result.double_groups;
    statistics_.condensed_blocks += result.condensed_blocks;
  }
  statistics_.touched_blocks = static_cast<std::uint32_t>(touched_.size());
}

BlockField::ClusterResult BlockField::evaluate_cluster(const Clusters::Reached& reached,
                                                       std::span<const Vec3> weights,
                                                       LocalLandmarks& local) noexcept {
  const Clusters::Cluster& cluster = clusters_.cluster(reached.cluster);
  ClusterResult result;
  bool are_local = false;  // condensed blocks need no landmarks
  for (std::uint32_t i = 0; i < cluster.block_count; ++i) {
    const std::size_t block = cluster.first_block + i;
    const std::int32_t slot = condensed_.column_of_block[block];
    if (slot == kOutOfReach) continue;
    bool is_touched = true;
    if (slot >= 0) {
      loops_.condensed(condensed_.columns.data() + static_cast<std::size_t>(slot) * condensed_.m * kPoints,
                       condensed_.moving.data(), condensed_.m, displacements_[block]);
      ++result.condensed_blocks;
    } else {
      if (!are_local) localize(reached, weights, local);
      are_local = true;
      const BlockPoints<float>& X = clusters_.points(block);
      const std::size_t pairs =
          cluster.is_dense
              ? loops_.direct_by_block(X, &clusters_.block_box(block), local.planes(), local.landmarks.data(),
                                       local.chosen.data(), displacements_[block])
              : loops_.direct_by_group(X, clusters_.group_boxes(block), local.planes(),
                                       local.landmarks.data(), local.chosen.data(), displacements_[block]);
      is_touched = pairs > 0;
      result.pairs += pairs;
      if (local.may_need_double)
        result.double_groups += sum_large_groups_in_double(block, cluster.centre, local);
    }
    result.touched_mask |= static_cast<std::uint32_t>(is_touched) << i;
  }
  return result;
}

void BlockField::localize(const Clusters::Reached& reached, std::span<const Vec3> weights,
                          LocalLandmarks& local) const noexcept {
  const Vec3& centre = clusters_.cluster(reached.cluster).centre;
  const auto indices = clusters_.landmark_indices().subspan(reached.first, reached.count);
  const double scale = 1 / support_radius_;
  double total_size = 0;
  local.count = indices.size();
  for (std::size_t j = 0; j < indices.size(); ++j) {
    const Vec3 p = (positions_[indices[j]] - centre) * scale;
    const Vec3& w = weights[indices[j]];
    const double size = w.norm();
    total_size += size;
    local.exact[j] = {p.x(), p.y(), p.z(), w.x(), w.y(), w.z()};
    local.x[j] = static_cast<float>(p.x());
    local.y[j] = static_cast<float>(p.y());
    local.z[j] = static_cast<float>(p.z());
    local.size[j] = size;
    local.landmarks[j] = {local.x[j],
                          local.y[j],
                          local.z[j],
                          static_cast<float>(w.x()),
                          static_cast<float>(w.y()),
                          static_cast<float>(w.z())};
  }
  for (std::size_t j = indices.size(); j % kGroupSize != 0; ++j) local.x[j] = kFarAway;
  local.may_need_double = total_size * kFloatErrorPerWeight > kFloatError;
}

// Sums groups whose weights are too large for float once more; returns how many.
std::uint32_t BlockField::sum_large_groups_in_double(std::size_t block, const Vec3& centre,
                                                     LocalLandmarks& local) noexcept {
  std::uint32_t groups = 0;
  for (std::size_t g = 0; g < kGroupsInBlock; ++g) {
    const std::size_t first = g * kGroupSize;
    const std::size_t count =
        loops_.choose(local.planes(), clusters_.group_boxes(block)[g], local.chosen.data());
    double size = 0;
    for (std::size_t j = 0; j < count; ++j) size += local.size[local.chosen[j]];
    if (size * kFloatErrorPerWeight <= kFloatError) continue;
    ++groups;
    BlockDisplacement<double> sum;
    loops_.direct_double(clusters_.exact_points(block, centre), first, local.exact.data(),
                         local.chosen.data(), count, sum);
    BlockDisplacement<float>& u = displacements_[block];
    for (std::size_t i = first; i < first + kGroupSize; ++i) {
      u.ux[i] = static_cast<float>(sum.ux[i]);
      u.uy[i] = static_cast<float>(sum.uy[i]);
      u.uz[i] = static_cast<float>(sum.uz[i]);
    }
  }
  return groups;
}

bool BlockField::can_condense(std::size_t m) const noexcept {
  return m > 0 && m <= options_.max_landmarks && reachable_points_ * m <= condensed_.columns.size();
}

void BlockField::begin_condensing(std::span<const double> inverse_columns, std::size_t m) noexcept {
  assert(can_condense(m) && inverse_columns.size() == positions_.size() * m);
  condensed_.inverse_columns = inverse_columns;
  condensed_.m = m;
  condensed_.next_cluster = 0;
  condensed_.next_block = 0;
}

bool BlockField::condense(std::uint64_t budget) noexcept {
  const auto reached = clusters_.reached();
  std::uint64_t spent = 0;
  while (condensed_.next_cluster < reached.size() && spent < budget) {
    const Clusters::Reached& r = reached[condensed_.next_cluster];
    const Clusters::Cluster& cluster = clusters_.cluster(r.cluster);
    condense_block(cluster.first_block + condensed_.next_block, r);
    spent += kPoints * r.count * (WorkCosts::kBuildPair + condensed_.m / WorkCosts::kColumnsBuiltForPair);
    if (++condensed_.next_block == cluster.block_count) {
      condensed_.next_block = 0;
      ++condensed_.next_cluster;
    }
  }
  return condensed_.next_cluster < reached.size();
}

void BlockField::condense_block(std::size_t block, const Clusters::Reached& reached) noexcept {
  const Clusters::Cluster& cluster = clusters_.cluster(reached.cluster);
  const BlockPoints<double> X = clusters_.exact_points(block, cluster.centre);
  std::fill_n(condensed_.build.begin(), condensed_.m * kPoints, 0.0);
  bool reaches_any = false;
  for (const std::uint32_t j : clusters_.landmark_indices().subspan(reached.first, reached.count)) {
    if (tissue_.blocks[block].squared_distance(positions_[j]) >= support_radius_ * support_radius_) continue;
    reaches_any = true;
    const Vec3 p = (positions_[j] - cluster.centre) / support_radius_;
    loops_.condense(X, p.x(), p.y(), p.z(), condensed_.inverse_columns.data() + j * condensed_.m,
                    condensed_.m, condensed_.build.data());
  }
  condensed_.blocks.push_back(static_cast<std::uint32_t>(block));
  if (!reaches_any) {
    condensed_.column_of_block[block] = kOutOfReach;
    return;
  }
  const std::size_t slot = condensed_.slots++;
  float* out = condensed_.columns.data() + slot * condensed_.m * kPoints;
  for (std::size_t i = 0; i < condensed_.m * kPoints; ++i) out[i] = static_cast<float>(condensed_.build[i]);
  condensed_.column_of_block[block] = static_cast<std::int32_t>(slot);
}

}  // namespace brachy
