#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/daemon/io/event_loop.h"
#include "apps/daemon/loops/simulation_runs.h"
#include "apps/session/plan_change_log.h"
#include "core/brachytherapy/plan/change/plan_ledger.h"
#include "core/brachytherapy/structures/structure.h"
#include "core/realtime/hand_over.h"
#include "core/scene/scene.h"
#include "net/wire/messages.h"

namespace brachy::net {
class Server;
}

namespace brachy {

/// The plan at a start with the changes of an earlier run of the session; none: there is no plan.
/// Throws UserError for changes that cannot be read.
std::optional<PlanLedger> plan_ledger(const Scene& scene, const std::optional<Plan>& plan,
                                      const std::optional<std::filesystem::path>& session);

/// Changes of the plan while it is carried out, as operators ask for them (PLAN in net/PROTOCOL.md): the needles that
/// are left are optimised for what lies in the body, on a thread of their own, or are those that an operator drew. A
/// change is written into the session, and then handed to the deformation, dose and snapshot threads.
/// Threads: the io thread; the readers, one thread each.
class PlanChanges {
 public:
  using Readers = HandOver<LoadingPlan>::Reader;

  /// `ledger`: none where there is no plan. `session`: the directory that is recorded to, and its time at tick 0, s;
  /// none: nothing is recorded. `lost`: seeds that an earlier run of the session lost. All references outlive this;
  /// `start` is the first work of the optimiser's thread. Throws UserError as PlanChangeLog.
  PlanChanges(const Scene& scene, const std::vector<Structure>& structures, std::optional<PlanLedger> ledger,
              std::optional<std::filesystem::path> session, double session_start_s,
              std::vector<std::int32_t> lost, EventLoop& loop, SimulationRuns& runs, net::Server& server,
              std::function<void()> start, std::function<void(const std::string&)> log);

  Readers& for_simulator() { return to_simulator_.reader; }  ///< deformation thread
  Readers& for_dose() { return to_dose_.reader; }            ///< dose thread
  Readers& for_events() { return to_events_.reader; }        ///< snapshot thread

  /// Carries out a request of `client` ("NAME (ADDRESS)"). Returns "" if it is or will be done, else the reason why
  /// not.
  std::string execute(const net::PlanMessage& request, const std::string& client);
  /// LOAD's needle by its number; null: it is not in the plan in use.
  const PlanNeedle* needle(std::uint16_t number) const;
  std::string no_needle(std::uint16_t number) const;  ///< what to say then
  bool has_plan() const { return ledger_.has_value(); }

  /// A snapshot: what lies in the body, and where the needles are. Where the simulation was reset, the plan is the
  /// scene's again.
  void on_snapshot(const std::shared_ptr<const MeshState>& state);
  bool is_optimising() const { return is_optimising_; }
  void stop() { optimiser_.stop(); }  ///< no change any more; what runs is not interrupted

 private:
  void restart();
  std::string refusal() const;
  std::string edit(const net::PlanMessage& request, const std::string& client);
  std::string optimise(const std::string& client);
  void take(std::optional<Plan> found, const std::string& failure, const std::string& client);
  void change_to(const Plan& whole, PlanChangeKind kind, const std::string& client);
  void hand_over();
  void publish();
  void announce(net::EventKind kind, const std::string& text);
  std::vector<char> begun() const;

  const Scene& scene_;
  const std::vector<Structure>& structures_;
  std::optional<PlanLedger> ledger_, first_;
  std::optional<PlanChangeLog> changes_;
  const double session_start_s_;
  EventLoop& loop_;
  SimulationRuns& runs_;
  net::Server& server_;
  const std::function<void(const std::string&)> log_;

  net::PlanKind kind_ = net::PlanKind::kFile;
  std::string by_;
  std::shared_ptr<const MeshState> state_;  // the newest; null: none yet
  std::vector<std::int32_t> lost_;
  std::uint64_t failed_seen_ = 0;
  bool is_optimising_ = false;
  std::vector<char> begun_published_;
  std::vector<char> begun_at_start_;  // when the optimiser was started
  std::uint64_t run_at_start_ = 0;
  HandOver<LoadingPlan> to_simulator_, to_dose_, to_events_;
  Worker optimiser_;  // last: it ends before what it uses
};

}  // namespace brachy
