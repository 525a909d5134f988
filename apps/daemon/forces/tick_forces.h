#pragma once

#include <cstdint>
#include <vector>

#include "core/simulation/mesh_state.h"

namespace brachy {

/// One needle's part of TickForces.
struct NeedleTick {
  NeedleForces forces;
  LocalContactModel model;
  bool is_in_contact = false;
  bool is_present = false;
  RigidTransform X_WN;               ///< mm
  std::uint64_t input_sequence = 0;  ///< of the pose the tick used, as NeedlePose has them
  std::int64_t input_stamp_ns = 0;
  std::int64_t input_received_ns = 0;
};

/// The part of a tick that determines the forces for the hands, and where the needles are: published every tick, not
/// with the 30 Hz snapshots.
struct TickForces {
  std::uint64_t run = 0, tick = 0;  ///< as TickSummary has them
  double sim_time_s = 0;
  std::int64_t start_ns = 0;        ///< when the tick began (set by the loop); 0: before the first
  std::vector<NeedleTick> needles;  ///< by id

  explicit TickForces(std::size_t needle_count = 0) : needles(needle_count) {}

  /// Precondition: as many needles as `state`. Real-time: no allocation.
  void copy_from(const MeshState& state) noexcept {
    run = state.summary.run;
    tick = state.summary.tick;
    sim_time_s = state.summary.sim_time_s;
    for (std::size_t n = 0; n < needles.size(); ++n) {
      const NeedleState& needle = state.needles.states[n];
      const bool is_in_contact = needle.contact == ContactState::kTouching ||
                                 needle.contact == ContactState::kInserted ||
                                 needle.contact == ContactState::kThrough;
      needles[n] = {needle.forces, needle.local_model,    is_in_contact,         needle.present,
                    needle.X_WN,   needle.input.sequence, needle.input.stamp_ns, needle.input.received_ns};
    }
  }
};

}  // namespace brachy
