#pragma once

#include <functional>
#include <memory>
#include <stop_token>

#include "core/realtime/triple_buffer.h"
#include "core/sim/mesh_state.h"

namespace brachy {

/// The 30 Hz loop: copies the newest mesh state and hands it to `deliver`. One that is not newer than the last is
/// not delivered. Returns how many were.
/// Threads: the snapshot thread's whole life; `deliver` is called on it. Allocates; not real-time.
std::uint64_t run_snapshot_loop(const std::stop_token& stop, double snapshot_hz,
                                TripleBuffer<MeshState>::Reader& states,
                                const std::function<void(std::shared_ptr<const MeshState>)>& deliver);

}  // namespace brachy
