#pragma once

#include <cstdint>
#include <vector>

#include "apps/brachyd/guard_events.h"
#include "core/plan/plan.h"
#include "core/sim/mesh_state.h"
#include "net/wire/messages.h"

namespace brachy {

/// What happened between one snapshot and the next, for people: contact, punctures, seeds, what the guard did.
/// Threads: one.
class TickEvents {
 public:
  /// `start`: before the first tick. `planned`: Plan::seeds; empty without a plan.
  TickEvents(const MeshState& start, std::vector<PlannedSeed> planned);

  /// Of a simulation that has begun anew since, only what it has brought itself.
  std::vector<net::EventMessage> update(const MeshState& state);

  std::uint32_t seeds_dropped() const { return seeds_dropped_; }
  std::uint32_t drops_refused() const { return drops_refused_; }

 private:
  void begin_anew(const MeshState& state);
  std::string text_of(const Seed& seed) const;

  std::vector<PlannedSeed> planned_;
  std::vector<NeedleState> last_;
  std::uint64_t run_;
  std::uint32_t seed_count_;
  std::uint32_t seeds_dropped_ = 0, drops_refused_ = 0;
  GuardEvents guard_;
};

}  // namespace brachy
