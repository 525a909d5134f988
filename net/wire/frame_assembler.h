#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "net/wire/messages.h"

namespace brachy::net {

/// A client's copy of the mesh: takes the TOPOLOGY, then FRAMEs in the order received, and holds after each the same
/// bits as the server's DeformedMesh::deformed_vertices. Pure; one thread.
class FrameAssembler {
 public:
  /// Restarts at rest. Returns "" or why the topology is refused (its hash does not match its content).
  std::string_view start(const TopologyMessage& topology);

  /// Returns "" or why the frame is refused; a refused frame changes nothing. Refused: no topology yet or another one,
  /// another point count, no full frame yet, missing seeds, changes since a tick later than this mesh's, or a change
  /// that goes back in time.
  std::string_view apply(const FrameMessage& frame);

  /// 3N: x0 y0 z0 x1 …, world frame, mm.
  const std::vector<float>& positions() const { return positions_; }
  const std::vector<Seed>& seeds() const { return seeds_; }  ///< in the order of falling
  std::uint64_t tick() const { return tick_; }               ///< of the last frame applied
  bool has_frame() const { return has_frame_; }

 private:
  bool adds_up(const FrameMessage& frame) const;

  std::uint64_t hash_ = 0;
  std::uint64_t tick_ = 0;
  bool has_topology_ = false;
  bool has_frame_ = false;
  std::vector<float> positions_;
  std::vector<Seed> seeds_;
};

}  // namespace brachy::net
