#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "apps/daemon/telemetry/guard_events.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/simulation/mesh_state.h"
#include "net/wire/messages.h"

namespace brachy {

/// Events between one snapshot and the next as messages for operators: contact, punctures, organs, seeds, actions
/// of the injectivity guard.
/// Threads: one.
class TickEvents {
 public:
  /// `start`: before the first tick. `planned`: Plan::seeds; empty without a plan. `organs`: names of
  /// SimulationModel::organs.
  TickEvents(const MeshState& start, std::vector<PlannedSeed> planned, std::vector<std::string> organs = {});

  /// Another plan from now on: all seeds that were ever planned, by number.
  void set_planned(std::vector<PlannedSeed> planned) { planned_ = std::move(planned); }

  /// The events since the last call. After a restart of the simulation only the new run's.
  std::vector<net::EventMessage> update(const MeshState& state);

  std::uint32_t seeds_dropped() const { return seeds_dropped_; }
  std::uint32_t drops_refused() const { return drops_refused_; }

 private:
  void restart_from_full_frame(const MeshState& state);
  std::string text_of(const Seed& seed) const;
  void add_failed_drops(const MeshState& state, std::vector<net::EventMessage>& events);
  void add_organs(const MeshState& state, std::vector<net::EventMessage>& events);

  std::vector<PlannedSeed> planned_;
  std::vector<NeedleState> last_;
  std::vector<std::string> organs_;
  std::vector<OrganContact> last_contacts_;
  std::uint64_t failed_drops_ = 0;
  std::uint64_t run_;
  std::uint32_t seed_count_;
  std::uint32_t seeds_dropped_ = 0, drops_refused_ = 0;
  GuardEvents guard_;
};

}  // namespace brachy
