#pragma once

#include <cstdint>
#include <memory>

#include "core/geometry/tissue/tissue.h"
#include "core/simulation/mesh_state.h"
#include "net/wire/messages.h"

namespace brachy::net {

/// The simulation as described by its FRAMEs, for a Server that relays it: the inverse of encode_frame. One thread.
class RelayedMesh {
 public:
  /// At rest. `needles`: of the scene.
  RelayedMesh(const TopologyMessage& topology, std::size_t needles);

  /// Points and surface, in the daemon's blocks; without the blocks' bounds.
  const Tissue& tissue() const { return tissue_; }

  /// Whether a FRAME belongs to this mesh.
  bool fits(const FrameMessage& frame) const {
    return frame.topology_hash == topology_hash_ && frame.point_count == tissue_.size();
  }

  /// Applies a FRAME of all points that fits, after a FrameAssembler with the same topology has accepted it; in order.
  /// `clock_offset_ns`: our clock minus the daemon's.
  void take(const FrameMessage& frame, std::int64_t clock_offset_ns);

  const MeshState& state() const { return state_; }

 private:
  void restart_from_full_frame();
  void take_points(const FrameMessage& frame);
  void take_needles(const FrameMessage& frame, std::int64_t clock_offset_ns);
  void take_poses(std::size_t needle, const std::vector<TickPose>& poses);
  void take_seeds(const FrameMessage& frame);

  const std::uint64_t topology_hash_;
  const Tissue tissue_;
  MeshState state_;
};

}  // namespace brachy::net
