#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/daemon/io/work_turns.h"
#include "apps/daemon/loops/simulation_runs.h"
#include "apps/session/plan_change_log.h"
#include "core/brachytherapy/plan/change/plan_ledger.h"
#include "core/brachytherapy/plan/gland_holes.h"
#include "core/brachytherapy/structures/structure.h"
#include "core/realtime/hand_over.h"
#include "core/scene/scene.h"
#include "net/requests/request.h"

namespace brachy::net {
class Server;
}

namespace brachy {

/// The plan at a start with the changes of an earlier run of the session; none: there is no plan.
/// Throws UserError for changes that cannot be read.
std::optional<PlanLedger> plan_ledger(const Scene& scene, const std::optional<Plan>& plan,
                                      const std::optional<SessionFolder>& session);

/// Changes of the plan while it is carried out, as operators ask for them (PLAN in net/PROTOCOL.md): the needles that
/// are left are optimised for what lies in the body, on a thread of their own, or are those that an operator drew. A
/// change is made and written into the session on another thread, one after the other, and then handed to the
/// deformation, dose and snapshot threads.
/// Threads: the io thread; the readers, one thread each.
class PlanChanges {
 public:
  using Readers = HandOver<LoadingPlan>::Reader;

  /// `ledger`: none where there is no plan. `session`: the directory that is recorded to, and its time at tick 0, s;
  /// none: nothing is recorded. `lost`: seeds that an earlier run of the session lost. All references outlive this;
  /// `start` is the first work of its two threads. Throws UserError as PlanChangeLog.
  PlanChanges(const Scene& scene, const std::vector<Structure>& structures, std::optional<PlanLedger> ledger,
              std::optional<SessionFolder> session, double session_start_s, std::vector<std::int32_t> lost,
              EventLoop& loop, SimulationRuns& runs, net::Server& server, const std::function<void()>& start,
              std::function<void(const std::string&)> log);

  Readers& for_simulator() { return to_simulator_.reader; }  ///< deformation thread
  Readers& for_dose() { return to_dose_.reader; }            ///< dose thread
  Readers& for_events() { return to_events_.reader; }        ///< snapshot thread

  /// Carries out a request. Returns "" if it is done, or will be done or refused (net::Sender::refuse), else the reason
  /// why not.
  std::string execute(net::PlanMessage request, const net::Sender& from);
  /// LOAD's needle by its number; null: it is not in the plan in use.
  const PlanNeedle* needle(std::uint16_t number) const;
  std::string no_needle(std::uint16_t number) const;  ///< what to say then
  bool has_plan() const { return plan_ != nullptr; }
  std::string no_plan() const;  ///< why it has none

  /// A snapshot: what lies in the body, and where the needles are. Where the simulation was reset, the plan is the
  /// scene's again.
  void on_snapshot(const std::shared_ptr<const MeshState>& state);
  bool is_busy() const { return optimiser_runs_ > 0 || !turns_.is_empty(); }  ///< one of its threads is
  void stop();  ///< no change any more; what runs is not interrupted

 private:
  /// A plan that does not change any more.
  struct Version {
    explicit Version(PlanLedger of) : ledger(std::move(of)), loading(ledger.loading()) {}
    PlanLedger ledger;
    LoadingPlan loading;
  };
  using VersionPtr = std::shared_ptr<const Version>;
  /// Makes the plan in use from the one that it is given, on the editor's thread. Throws std::exception.
  using MakePlan = std::function<Plan(const PlanLedger&)>;

  void restart();
  std::string refusal() const;
  std::string refusal(const net::PlanMessage& request, std::uint64_t client) const;
  std::string edit(const std::shared_ptr<const net::PlanMessage>& request, const net::Sender& from);
  std::string optimise(const net::Sender& from);
  void take(std::uint64_t optimisation, std::optional<Plan> found, std::string failure,
            const net::Sender& from);
  void end_optimisation(const std::string& failure);
  Plan drawn_plan(const net::PlanMessage& request, const Plan& like);
  WorkTurns::Work change(MakePlan make, PlanChangeKind kind, const net::Sender& from,
                         std::function<void(const std::string& why)> refuse);
  void put_in_use(const VersionPtr& changed, const Plan& rest, PlanChangeKind kind, const net::Sender& from);
  void hand_over(std::array<LoadingPlan, 3> loading);
  void publish();
  void announce(net::EventKind kind, const std::string& text);
  std::vector<char> begun() const;

  const Scene& scene_;
  const std::vector<Structure>& structures_;
  const VersionPtr first_;  // null: there is no plan
  VersionPtr plan_;         // in use
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
  std::vector<char> begun_published_;

  bool is_optimising_ = false;
  std::uint64_t optimisation_ = 0;  // its number; results of others are not used
  net::Sender optimised_for_;
  std::uint64_t dropped_by_ = 0;      // whose edit ended the last one before its result; 0: none did
  std::size_t optimiser_runs_ = 0;    // that have not reported yet
  std::vector<char> begun_at_start_;  // when the optimiser was started
  std::uint64_t run_at_start_ = 0;

  HandOver<LoadingPlan> to_simulator_, to_dose_, to_events_;
  std::optional<std::vector<GlandHole>> holes_;  // on the editor's thread, once it has needed them
  std::optional<PlanChangeLog> changes_;         // likewise, once constructed
  WorkTurns turns_{loop_, editor_};
  Worker optimiser_, editor_;  // last: they end before what they use
};

}  // namespace brachy
