#pragma once

#include <cstdint>
#include <memory>

#include "core/sim/mesh_state.h"
#include "core/tissue/tissue.h"
#include "net/wire/messages.h"

namespace brachy::net {

/// The simulation as its FRAMEs tell it, for a Server that shows it to others: what encode_frame writes, read back. One thread.
class RelayedMesh {
 public:
  /// At rest. `needles`: of the scene.
  RelayedMesh(const TopologyMessage& topology, std::size_t needles);

  /// Points and surface, in the blocks that the daemon cut them into; without the blocks' bounds.
  const Tissue& tissue() const { return tissue_; }

  /// Whether a FRAME is one of this mesh's.
  bool fits(const FrameMessage& frame) const {
    return frame.topology_hash == topology_hash_ && frame.point_count == tissue_.size();
  }

  /// Takes a FRAME that fits, of all points that a FrameAssembler with the same topology took too, after all those before it.
  /// `clock_offset_ns`: our clock minus the daemon's.
  void take(const FrameMessage& frame, std::int64_t clock_offset_ns);

  const MeshState& state() const { return state_; }

 private:
  void begin_anew();
  void take_points(const FrameMessage& frame);
  void take_needles(const FrameMessage& frame, std::int64_t clock_offset_ns);
  void take_poses(std::size_t needle, const std::vector<TickPose>& poses);
  void take_seeds(const FrameMessage& frame);

  const std::uint64_t topology_hash_;
  const Tissue tissue_;
  MeshState state_;
};

}  // namespace brachy::net
