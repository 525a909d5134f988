#include "net/wire/frame_assembler.h"

#include <algorithm>

#include "net/wire/codec.h"

namespace brachy::net {

std::string_view FrameAssembler::start(const TopologyMessage& topology) {
  if (topology_hash(topology) != topology.hash) return "the topology's hash does not match its content";
  hash_ = topology.hash;
  tick_ = 0;
  has_topology_ = true;
  has_frame_ = false;
  positions_ = topology.rest_vertices;
  seeds_.clear();
  return {};
}

std::string_view FrameAssembler::apply(const FrameMessage& frame) {
  if (!has_topology_) return "a frame came before the topology";
  if (frame.topology_hash != hash_) return "the frame belongs to another topology";
  if (std::size_t{frame.point_count} * 3 != positions_.size())
    return "the frame has another number of points";
  if (!frame.full) {
    if (!has_frame_) return "the first frame is not a full one";
    if (frame.base_tick > tick_) return "the frame's base tick is later than this mesh's tick";
    if (frame.tick < tick_) return "the frame is older than this mesh";
  }
  if (!adds_up(frame)) return "the frame lacks seeds that this mesh has not";
  std::size_t from = 0;
  for (const PointRange& range : frame.ranges) {
    const std::size_t count = 3 * std::size_t{range.count};
    std::copy_n(frame.positions.begin() + static_cast<std::ptrdiff_t>(from), count,
                positions_.begin() + 3 * static_cast<std::ptrdiff_t>(range.first));
    from += count;
  }
  if (frame.has_seeds) seeds_.resize(frame.seed_count);
  if (frame.full && !frame.has_seeds) seeds_.clear();
  for (const Seed& seed : frame.seeds) seeds_[seed.id - 1] = seed;
  tick_ = frame.tick;
  has_frame_ = true;
  return {};
}

// Seeds are never taken out: those that are new here must be in the frame.
bool FrameAssembler::adds_up(const FrameMessage& frame) const {
  if (!frame.has_seeds) return frame.full || seeds_.empty();
  const std::size_t known = frame.full ? 0 : seeds_.size();
  if (frame.seed_count < known) return false;
  const auto is_new = [&](const Seed& seed) { return seed.id > known; };
  return static_cast<std::size_t>(std::ranges::count_if(frame.seeds, is_new)) == frame.seed_count - known;
}

}  // namespace brachy::net
