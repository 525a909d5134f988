#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/simulation/mesh_state.h"

namespace brachy {

/// The seeds in the tissue, handed from the deformation thread to the dose thread whenever one was dropped or failed:
/// within a tick or two, not with the 30 Hz snapshots.
struct DroppedSeeds {
  std::vector<Seed> slots;
  std::uint32_t count = 0;
  FailedDrops failed;           ///< lost and refused ones
  std::uint64_t run = 0;        ///< TickSummary::run
  std::int64_t publish_ns = 0;  ///< monotonic clock

  /// With the capacity and the seeds of `state`.
  explicit DroppedSeeds(const MeshState& state) : slots(state.seeds.slots), count(state.seeds.count) {}

  std::span<const Seed> seeds() const { return {slots.data(), count}; }
  /// Real-time: no allocation.
  void copy_from(const MeshState& state) noexcept {
    std::ranges::copy(state.seeds.in_tissue(), slots.begin());
    count = state.seeds.count;
    failed = state.failed_drops;
    run = state.summary.run;
  }
};

}  // namespace brachy
