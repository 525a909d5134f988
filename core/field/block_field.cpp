#include "core/field/block_field.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace brachy {
namespace {

constexpr std::size_t kPoints = Tissue::kBlockSize;

// A float sum of ψ w is off by at most about this share of Σ|w|: six roundings of 2⁻²⁴ in ψ and its distance, one in the
// product, and those of the sum (block_field_test measures it).
constexpr double kFloatErrorPerWeight = 2.5e-7;

// Work below which threads cost more than they save: fork-join is 1 µs on free cores but a scheduler slice of 8 ms on
// taken ones, so only ticks of some milliseconds are shared out.
constexpr std::uint64_t kPairsWorthThreads = 4'000'000;
constexpr std::uint64_t kColumnsWorthThreads = 4'000'000;

constexpr std::uint64_t kBuildPair =
    3;  // a pair in double with its column share, against a direct float pair
constexpr std::uint64_t kColumnsForOne = 3;  // columns updated in the time of one direct pair

constexpr std::int32_t kNotCondensed = -1, kOutOfReach = -2;  // instead of a slot

bool is_near(const Vec3& landmark, double support_radius, const Block& block) {
  return (block.min - landmark).cwiseMax(landmark - block.max).cwiseMax(0.0).squaredNorm() <
         support_radius * support_radius;
}

}  // namespace

/// A cluster's landmarks in its coordinates: planes for the box test, records for the loops.
struct BlockField::LocalLandmarks {
  static constexpr std::size_t kChunk = 256;  // on the stack; more landmarks go in rounds
  alignas(64) float x[kChunk], y[kChunk], z[kChunk], squared_distance[kChunk];
  BlockLandmark<float> all[kChunk], chosen[kChunk];
  float size[kChunk];  // |w|
};

BlockField::BlockField(const Tissue& tissue, Kernel kernel, double support_radius, const Options& options)
    : tissue_(tissue),
      support_radius_(support_radius),
      options_(options),
      loops_(block_kernels(kernel, options.target)),
      clusters_(tissue, support_radius, options.max_landmarks) {
  assert(is_supported(options.target));
  const std::size_t blocks = tissue.blocks.size();
  positions_.reserve(options.max_landmarks);
  results_.resize(clusters_.size());
  touched_.reserve(blocks);
  displacements_.resize(blocks);
  column_of_block_.assign(blocks, kNotCondensed);
  condensed_list_.reserve(blocks);
  const std::size_t all_columns = blocks * options.max_landmarks * kPoints;
  columns_.resize(std::min(all_columns, options.max_condensed_bytes / sizeof(float)));
  build_.resize(options.max_landmarks * kPoints);
  moving_.resize(3 * options.max_landmarks);
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
  for (const std::uint32_t block : condensed_list_) column_of_block_[block] = kNotCondensed;
  condensed_list_.clear();
  slots_ = 0;
  m_ = 0;
}

void BlockField::evaluate(std::span<const Vec3> weights, std::span<const Vec3> moving) noexcept {
  assert(weights.size() == positions_.size());
  assert(condensed_list_.empty() || moving.size() == m_);
  for (std::size_t k = 0; k < moving.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      moving_[3 * k + static_cast<std::size_t>(axis)] = static_cast<float>(moving[k][axis]);

  const auto reached = clusters_.reached();
  const auto count = static_cast<std::ptrdiff_t>(reached.size());
  const bool all_condensed = m_ > 0 && next_cluster_ == reached.size();
  const bool worth_threads = (!all_condensed && reachable_pairs_ > kPairsWorthThreads) ||
                             slots_ * kPoints * m_ > kColumnsWorthThreads;
  // One thread does not enter OpenMP at all: libgomp allocates at every parallel region.
  if (options_.threads == 1 || !worth_threads) {
    for (std::ptrdiff_t c = 0; c < count; ++c)
      results_[static_cast<std::size_t>(c)] = evaluate_cluster(reached[static_cast<std::size_t>(c)], weights);
  } else {
#pragma omp parallel for schedule(dynamic, 4) num_threads(options_.threads)
    for (std::ptrdiff_t c = 0; c < count; ++c)
      results_[static_cast<std::size_t>(c)] = evaluate_cluster(reached[static_cast<std::size_t>(c)], weights);
  }

  touched_.clear();
  statistics_ = {};
  for (std::size_t c = 0; c < reached.size(); ++c) {
    const ClusterResult& result = results_[c];
    const Clusters::Cluster& cluster = clusters_.cluster(reached[c].cluster);
    for (std::uint32_t i = 0; i < cluster.block_count; ++i)
      if (result.touched_mask >> i & 1) touched_.push_back(cluster.first_block + i);
    statistics_.pairs += result.pairs;
    statistics_.double_blocks += result.double_blocks;
    statistics_.condensed_blocks += result.condensed_blocks;
  }
  statistics_.touched_blocks = static_cast<std::uint32_t>(touched_.size());
}

BlockField::ClusterResult BlockField::evaluate_cluster(const Clusters::Reached& reached,
                                                       std::span<const Vec3> weights) noexcept {
  const Clusters::Cluster& cluster = clusters_.cluster(reached.cluster);
  const auto indices = clusters_.landmark_indices().subspan(reached.first, reached.count);
  ClusterResult result;
  LocalLandmarks local;
  const double scale = 1 / support_radius_;
  const std::size_t n = std::min(indices.size(), LocalLandmarks::kChunk);
  const bool in_one_chunk = indices.size() <= LocalLandmarks::kChunk;
  bool are_local = false;  // condensed blocks need no landmarks
  const auto localize = [&] {
    are_local = true;
    for (std::size_t j = 0; j < n; ++j) {
      const Vec3 p = (positions_[indices[j]] - cluster.centre) * scale;
      const Vec3& w = weights[indices[j]];
      local.x[j] = static_cast<float>(p.x());
      local.y[j] = static_cast<float>(p.y());
      local.z[j] = static_cast<float>(p.z());
      local.all[j] = {local.x[j],
                      local.y[j],
                      local.z[j],
                      static_cast<float>(w.x()),
                      static_cast<float>(w.y()),
                      static_cast<float>(w.z())};
      local.size[j] = static_cast<float>(w.norm());
    }
  };
  for (std::uint32_t i = 0; i < cluster.block_count; ++i) {
    const std::size_t block = cluster.first_block + i;
    if (column_of_block_[block] == kOutOfReach) continue;
    if (column_of_block_[block] >= 0) {
      loops_.condensed(columns_.data() + static_cast<std::size_t>(column_of_block_[block]) * m_ * kPoints,
                       moving_.data(), m_, displacements_[block]);
      result.touched_mask |= 1u << i;
      ++result.condensed_blocks;
      continue;
    }
    if (!in_one_chunk) {
      evaluate_block_exactly(block, cluster, indices, weights);
      result.touched_mask |= 1u << i;
      ++result.double_blocks;
      result.pairs += kPoints * indices.size();
      continue;
    }
    if (!are_local) localize();
    const Clusters::LocalBox& box = clusters_.box(block);
    for (std::size_t j = 0; j < n; ++j) {
      const float dx = std::max(std::max(box.min[0] - local.x[j], local.x[j] - box.max[0]), 0.0f);
      const float dy = std::max(std::max(box.min[1] - local.y[j], local.y[j] - box.max[1]), 0.0f);
      const float dz = std::max(std::max(box.min[2] - local.z[j], local.z[j] - box.max[2]), 0.0f);
      local.squared_distance[j] = dx * dx + dy * dy + dz * dz;
    }
    std::size_t chosen = 0;
    float total_size = 0;
    for (std::size_t j = 0; j < n; ++j) {
      const bool near = local.squared_distance[j] < 1.0f;
      local.chosen[chosen] = local.all[j];
      chosen += near;
      total_size += near ? local.size[j] : 0.0f;
    }
    if (chosen == 0) continue;
    result.touched_mask |= 1u << i;
    result.pairs += kPoints * chosen;
    if (static_cast<double>(total_size) * kFloatErrorPerWeight > kFloatError) {
      evaluate_block_exactly(block, cluster, indices, weights);
      ++result.double_blocks;
    } else {
      loops_.direct_float(clusters_.points(block), local.chosen, chosen, displacements_[block]);
    }
  }
  return result;
}

void BlockField::evaluate_block_exactly(std::size_t block, const Clusters::Cluster& cluster,
                                        std::span<const std::uint32_t> landmarks,
                                        std::span<const Vec3> weights) noexcept {
  const BlockPoints<double> X = clusters_.exact_points(block, cluster.centre);
  BlockDisplacement<double> sum = {}, part;
  constexpr std::size_t kChunk = 64;
  BlockLandmark<double> local[kChunk];
  for (std::size_t first = 0; first < landmarks.size(); first += kChunk) {
    const std::size_t n = std::min(kChunk, landmarks.size() - first);
    for (std::size_t j = 0; j < n; ++j) {
      const Vec3 p = (positions_[landmarks[first + j]] - cluster.centre) / support_radius_;
      const Vec3& w = weights[landmarks[first + j]];
      local[j] = {p.x(), p.y(), p.z(), w.x(), w.y(), w.z()};
    }
    loops_.direct_double(X, local, n, part);
    for (std::size_t i = 0; i < kPoints; ++i) {
      sum.ux[i] += part.ux[i];
      sum.uy[i] += part.uy[i];
      sum.uz[i] += part.uz[i];
    }
  }
  BlockDisplacement<float>& u = displacements_[block];
  for (std::size_t i = 0; i < kPoints; ++i) {
    u.ux[i] = static_cast<float>(sum.ux[i]);
    u.uy[i] = static_cast<float>(sum.uy[i]);
    u.uz[i] = static_cast<float>(sum.uz[i]);
  }
}

bool BlockField::can_condense(std::size_t m) const noexcept {
  return m > 0 && m <= options_.max_landmarks && reachable_points_ * m <= columns_.size();
}

void BlockField::begin_condensing(std::span<const double> inverse_columns, std::size_t m) noexcept {
  assert(can_condense(m) && inverse_columns.size() == positions_.size() * m);
  inverse_columns_ = inverse_columns;
  m_ = m;
  next_cluster_ = 0;
  next_block_ = 0;
}

bool BlockField::condense(std::uint64_t budget) noexcept {
  const auto reached = clusters_.reached();
  std::uint64_t spent = 0;
  while (next_cluster_ < reached.size() && spent < budget) {
    const Clusters::Reached& r = reached[next_cluster_];
    const Clusters::Cluster& cluster = clusters_.cluster(r.cluster);
    condense_block(cluster.first_block + next_block_, r);
    spent += kPoints * r.count * (kBuildPair + m_ / kColumnsForOne);
    if (++next_block_ == cluster.block_count) {
      next_block_ = 0;
      ++next_cluster_;
    }
  }
  return next_cluster_ < reached.size();
}

void BlockField::condense_block(std::size_t block, const Clusters::Reached& reached) noexcept {
  const Clusters::Cluster& cluster = clusters_.cluster(reached.cluster);
  const BlockPoints<double> X = clusters_.exact_points(block, cluster.centre);
  std::fill_n(build_.begin(), m_ * kPoints, 0.0);
  bool reaches_any = false;
  for (const std::uint32_t j : clusters_.landmark_indices().subspan(reached.first, reached.count)) {
    if (!is_near(positions_[j], support_radius_, tissue_.blocks[block])) continue;
    reaches_any = true;
    const Vec3 p = (positions_[j] - cluster.centre) / support_radius_;
    loops_.condense(X, p.x(), p.y(), p.z(), inverse_columns_.data() + j * m_, m_, build_.data());
  }
  condensed_list_.push_back(static_cast<std::uint32_t>(block));
  if (!reaches_any) {
    column_of_block_[block] = kOutOfReach;
    return;
  }
  const std::size_t slot = slots_++;
  float* out = columns_.data() + slot * m_ * kPoints;
  for (std::size_t i = 0; i < m_ * kPoints; ++i) out[i] = static_cast<float>(build_[i]);
  column_of_block_[block] = static_cast<std::int32_t>(slot);
}

}  // namespace brachy
