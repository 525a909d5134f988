#include "core/simulation/shown_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace brachy {

ShownMesh::ShownMesh(const Tissue& tissue)
    : tissue_(tissue), block_ticks_(tissue.blocks.size()), block_evaluated_(tissue.blocks.size()) {
  displaced_.reserve(tissue.blocks.size());
  was_displaced_.reserve(tissue.blocks.size());
  for (auto& blocks : changed_) blocks.reserve(tissue.blocks.size());
  rest_.reserve(3 * tissue.size());
  for (const Vec3& X : tissue.rest_vertices)
    for (int k = 0; k < 3; ++k) rest_.push_back(static_cast<float>(X[k]));
  deformed_ = rest_;
}

void ShownMesh::begin(std::uint64_t tick) noexcept {
  tick_ = tick;
  changed().clear();
}

void ShownMesh::show(const DisplacementField& field, const BodyFrame& frame) noexcept {
  max_displacement_ = 0;
  moved_vertices_ = 0;
  if (is_in(frame) && frame.is_identity())
    show_touched(field);
  else
    show_everywhere(field, frame);
  frame_ = frame;
}

void ShownMesh::show_everywhere(const DisplacementField& field, const BodyFrame& frame) noexcept {
  displaced_.clear();
  for (const std::uint32_t b : field.touched()) block_evaluated_[b] = tick_;
  for (std::uint32_t b = 0; b < tissue_.blocks.size(); ++b) {
    if (move_block(b, block_evaluated_[b] == tick_ ? &field.displacement(b) : nullptr, frame))
      displaced_.push_back(b);
    changed().push_back(b);
    block_ticks_[b] = tick_;
  }
}

// True if any of its points is not where it rests.
bool ShownMesh::move_block(std::uint32_t b, const BlockDisplacement<float>* u,
                           const BodyFrame& frame) noexcept {
  const Block& block = tissue_.blocks[b];
  bool moves = false;
  for (std::uint32_t i = 0; i < block.count; ++i) {
    const float* rest = &rest_[3 * (block.first + i)];
    Eigen::Vector3f x(rest[0], rest[1], rest[2]);
    if (u) x += Eigen::Vector3f(u->ux[i], u->uy[i], u->uz[i]);
    if (!frame.is_identity()) x = frame.to_world(x.cast<double>()).cast<float>();
    const double way = (x - Eigen::Vector3f(rest[0], rest[1], rest[2])).cast<double>().norm();
    max_displacement_ = std::max(max_displacement_, way);
    moved_vertices_ += way > 0;
    moves |= way > 0;
    std::copy_n(x.data(), 3, &deformed_[3 * (block.first + i)]);
  }
  return moves;
}

void ShownMesh::show_touched(const DisplacementField& field) noexcept {
  std::swap(displaced_, was_displaced_);
  displaced_.clear();
  for (const std::uint32_t b : field.touched()) {
    block_evaluated_[b] = tick_;
    if (show_block(b, field.displacement(b))) changed().push_back(b);
  }
  for (const std::uint32_t b : was_displaced_) {
    if (block_evaluated_[b] == tick_) continue;
    const Block& block = tissue_.blocks[b];
    std::copy_n(&rest_[3 * block.first], 3 * block.count, &deformed_[3 * block.first]);
    changed().push_back(b);
  }
  for (const std::uint32_t b : changed()) block_ticks_[b] = tick_;
}

// True if any coordinate of the block changed.
bool ShownMesh::show_block(std::uint32_t b, const BlockDisplacement<float>& u) noexcept {
  const Block& block = tissue_.blocks[b];
  float* out = &deformed_[3 * block.first];
  const float* rest = &rest_[3 * block.first];
  bool changed = false;
  std::uint32_t moved = 0;
  float largest_squared = 0;
  for (std::uint32_t i = 0; i < block.count; ++i) {
    const float x[3] = {rest[3 * i] + u.ux[i], rest[3 * i + 1] + u.uy[i], rest[3 * i + 2] + u.uz[i]};
    changed |= x[0] != out[3 * i] || x[1] != out[3 * i + 1] || x[2] != out[3 * i + 2];
    moved += x[0] != rest[3 * i] || x[1] != rest[3 * i + 1] || x[2] != rest[3 * i + 2];
    std::memcpy(out + 3 * i, x, sizeof x);
    largest_squared = std::max(largest_squared, u.ux[i] * u.ux[i] + u.uy[i] * u.uy[i] + u.uz[i] * u.uz[i]);
  }
  max_displacement_ = std::max(max_displacement_, std::sqrt(static_cast<double>(largest_squared)));
  moved_vertices_ += moved;
  if (moved > 0) displaced_.push_back(b);
  return changed;
}

void ShownMesh::write(std::uint64_t since, DeformedMesh& slot) const noexcept {
  const auto update_block = [&](std::size_t b) {
    if (slot.block_ticks[b] == block_ticks_[b]) return;
    const Block& block = tissue_.blocks[b];
    std::copy_n(&deformed_[3 * block.first], 3 * block.count, &slot.deformed_vertices[3 * block.first]);
    slot.block_ticks[b] = block_ticks_[b];
  };
  if (tick_ - since <= kChangeHistory) {
    for (std::uint64_t t = since + 1; t <= tick_; ++t)
      for (const std::uint32_t b : changed_[t % kChangeHistory]) update_block(b);
  } else {
    for (std::size_t b = 0; b < tissue_.blocks.size(); ++b) update_block(b);
  }
}

Vec3 ShownMesh::mean_displacement() const noexcept {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < rest_.size(); ++i) sum[static_cast<int>(i % 3)] += deformed_[i] - rest_[i];
  return sum / static_cast<double>(tissue_.size());
}

}  // namespace brachy
