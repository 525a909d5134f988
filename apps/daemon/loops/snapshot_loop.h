#pragma once

#include <functional>
#include <memory>
#include <stop_token>

#include "core/realtime/deadline.h"
#include "core/realtime/hand_over.h"
#include "core/simulation/mesh_state.h"

namespace brachy {

/// The 30 Hz loop: copies the newest mesh state and passes it to `deliver`, unless it was delivered before.
/// Returns how many were delivered.
/// Threads: the snapshot thread's whole life; `deliver` is called on it. Allocates; not real-time.
std::uint64_t run_snapshot_loop(const std::stop_token& stop, Clock& clock, double snapshot_hz,
                                HandOver<MeshState>::Reader& states,
                                const std::function<void(std::shared_ptr<const MeshState>)>& deliver);

}  // namespace brachy
