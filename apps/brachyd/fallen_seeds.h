#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/sim/mesh_state.h"

namespace brachy {

/// The seeds in the tissue, handed from the deformation thread to the dose thread whenever one has fallen: a tick or so after
/// it did, not with the 30 Hz snapshots.
struct FallenSeeds {
  std::vector<Seed> slots;
  std::uint32_t count = 0;
  std::uint64_t run = 0;        ///< MeshState::run
  std::int64_t publish_ns = 0;  ///< monotonic clock

  /// Room for as many as `state` has; holds those that it has.
  explicit FallenSeeds(const MeshState& state) : slots(state.seed_slots), count(state.seed_count) {}

  std::span<const Seed> seeds() const { return {slots.data(), count}; }
  /// Real-time: no allocation.
  void copy_from(const MeshState& state) noexcept {
    std::ranges::copy(state.seeds(), slots.begin());
    count = state.seed_count;
    run = state.run;
  }
};

}  // namespace brachy
