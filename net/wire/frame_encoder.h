#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/simulation/mesh_state.h"
#include "net/wire/byte_io.h"
#include "net/wire/messages.h"

namespace brachy::net {

/// A tissue as a message; `hash` is filled in. Positions are rounded to f32. `surface`: its surface alone.
TopologyMessage make_topology(const Tissue& tissue, const std::string& name, bool surface = false);

/// The points that FRAMEs hold: all of a tissue's, or its surface vertices alone.
struct FrameLayout {
  std::vector<Block> blocks;  ///< the tissue's; of its surface alone those come first
  std::uint32_t point_count = 0;
  std::uint64_t topology_hash = 0;
};
FrameLayout make_layout(const Tissue& tissue, const TopologyMessage& topology);

/// The part of a snapshot that one receiver needs.
struct FrameRequest {
  std::uint64_t after_tick = 0;  ///< the tick the receiver was last sent
  bool full = true;              ///< all points; else those changed after `after_tick`
  bool pose_history = false;     ///< add the poses used after `after_tick`
  bool surface = false;          ///< of the surface vertices alone
  auto operator<=>(const FrameRequest&) const =
      default;  // NOLINT(modernize-use-nullptr): clang-tidy 14 on <=>
};

/// Appends the body of a FRAME, always with the section CERTIFICATE, with LAG unless the lag is NaN (not known), with
/// the forces of each needle that are finite and the shape of each that bends, and with the seeds that fell or moved
/// after `after_tick` once any has fallen.
/// Changed blocks are those with block_ticks[b] > after_tick; neighbours become one range. `layout` is what the
/// request asks for; `state.mesh.block_ticks` has one tick per block at least, and after_tick <=
/// state.summary.tick (both asserted). A state may lack needles, or their histories: then the frame lacks them too.
void encode_frame(const MeshState& state, const FrameLayout& layout, std::uint64_t snapshot_sequence,
                  const FrameRequest& request, Bytes& out);

}  // namespace brachy::net
