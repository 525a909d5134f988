#include "apps/daemon/control/plan_changes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <utility>

#include "core/base/error.h"
#include "core/brachytherapy/plan/change/hole_loading.h"
#include "core/brachytherapy/plan/optimiser/optimise_plan.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/simulation/new_failed_drops.h"
#include "net/server/server.h"

namespace brachy {
namespace {

/// The rest that an operator drew; what is left open is loaded by the rule.
Plan drawn_plan(const net::PlanMessage& request, const Plan& like, const std::vector<Structure>& structures,
                const TemplateGrid& grid) {
  Plan rest = like;
  rest.needles.clear();
  std::vector<double> depths;
  for (const net::PlanMessageNeedle& drawn : request.needles) {
    PlanNeedle needle{drawn.hole, 0, drawn.train};
    double depth = drawn.depth_mm;
    if (std::isnan(depth) || needle.train.empty()) {
      const HoleLoading loading = load_hole(structures, grid, drawn.hole);
      if (std::isnan(depth)) depth = loading.depth_mm;
      if (needle.train.empty()) needle.train = loading.train;
    }
    if (!std::isfinite(depth)) throw UserError("hole " + drawn.hole + ": its depth is not finite");
    depths.push_back(depth);
    rest.needles.push_back(std::move(needle));
  }
  for (const double depth : depths) rest.base_plane_mm = std::max(rest.base_plane_mm, depth);
  for (std::size_t n = 0; n < depths.size(); ++n)
    rest.needles[n].retraction_mm = rest.base_plane_mm - depths[n];
  return rest;
}

}  // namespace

std::optional<PlanLedger> plan_ledger(const Scene& scene, const std::optional<Plan>& plan,
                                      const std::optional<std::filesystem::path>& session) {
  if (!plan) return std::nullopt;
  PlanLedger ledger(*plan, scene.template_grid, scene.needle.length_mm);
  if (!session) return ledger;
  for (const PlanChange& change : load_plan_changes(*session))
    ledger.change_to(load_plan(*session / change.file, scene.template_grid, scene.needle.length_mm));
  return ledger;
}

PlanChanges::PlanChanges(const Scene& scene, const std::vector<Structure>& structures,
                         std::optional<PlanLedger> ledger, std::optional<std::filesystem::path> session,
                         double session_start_s, std::vector<std::int32_t> lost, EventLoop& loop,
                         SimulationRuns& runs, net::Server& server, std::function<void()> start,
                         std::function<void(const std::string&)> log)
    : scene_(scene),
      structures_(structures),
      ledger_(std::move(ledger)),
      first_(ledger_),
      session_start_s_(session_start_s),
      loop_(loop),
      runs_(runs),
      server_(server),
      log_(std::move(log)),
      by_(std::filesystem::path(scene.plan_file).filename().string()),
      lost_(std::move(lost)),
      to_simulator_(ledger_ ? ledger_->loading() : LoadingPlan()),
      to_dose_(to_simulator_.reader.value()),
      to_events_(to_simulator_.reader.value()) {
  optimiser_.post(std::move(start));
  if (!ledger_) return;
  if (session) {
    changes_.emplace(*session);
    if (!changes_->changes().empty()) {
      const PlanChange& last = changes_->changes().back();
      by_ = last.what;
      kind_ = last.kind == PlanChangeKind::kOptimised ? net::PlanKind::kOptimised : net::PlanKind::kEdited;
    }
  }
  publish();
}

std::string PlanChanges::execute(const net::PlanMessage& request, const std::string& client) {
  const bool is_edit = request.kind == net::PlanKind::kEdited;
  if (!is_edit && request.kind != net::PlanKind::kOptimised)
    return fmt::format("there is no request {}: 2 optimise the rest, 3 the rest is to be these needles",
                       static_cast<unsigned>(request.kind));
  if (const std::string why = refusal(); !why.empty()) return why;
  if (request.change != ledger_->changes())
    return fmt::format("the plan has changed meanwhile: this request goes on from change {}, and it is at {}",
                       request.change, ledger_->changes());
  return is_edit ? edit(request, client) : optimise(client);
}

std::string PlanChanges::refusal() const {
  if (!ledger_)
    return scene_.implant.is_hdr()
               ? "catheters of an afterloader carry no seeds: there is no plan of them to change"
               : "there is no plan: give the scene plan.file";
  if (is_optimising_) return "the rest is being optimised: wait for the result";
  if (runs_.is_preparing()) return "a model is being prepared: try again once it is in use";
  if (!state_) return "the simulation has not begun: try again";
  // Needles that lock the gland stay in, and carry no seeds.
  for (std::size_t n = 0; n + scene_.needle.locking_count < scene_.needle.count; ++n) {
    const NeedleState& needle = state_->needles.states[n];
    if (needle.present &&
        (needle.contact == ContactState::kInserted || needle.contact == ContactState::kThrough))
      return fmt::format("needle {} is in the tissue: draw it out first", n);
  }
  return {};
}

std::vector<char> PlanChanges::begun() const {
  return ledger_->begun(state_->seeds.in_tissue(), lost_);
}

std::string PlanChanges::edit(const net::PlanMessage& request, const std::string& client) {
  try {
    const Plan rest = drawn_plan(request, ledger_->all(), structures_, scene_.template_grid);
    change_to(ledger_->with_rest(begun(), rest), PlanChangeKind::kEdited, client);
  } catch (const UserError& e) {
    return e.what();
  }
  return {};
}

std::string PlanChanges::optimise(const std::string& client) {
  begun_at_start_ = begun();
  run_at_start_ = state_->summary.run;
  const Plan rest = ledger_->rest(begun_at_start_);
  if (rest.needles.empty()) return "no needle of the plan is left: all have left seeds";
  std::vector<std::string> taken;
  for (std::size_t n = 0; n < begun_at_start_.size(); ++n)
    if (begun_at_start_[n]) taken.push_back(ledger_->all().needles[n].hole);
  is_optimising_ = true;
  publish();
  optimiser_.post([this, rest, taken, client, placed = ledger_->placed(state_->seeds.in_tissue(), lost_)] {
    std::optional<Plan> found;
    std::string failure;
    try {
      found = replan(structures_, scene_.template_grid, rest, placed, scene_.needle.length_mm,
                     replan_settings(), taken)
                  .plan;
    } catch (const std::exception& e) {
      failure = e.what();
    }
    loop_.post([this, found = std::move(found), failure, client] { take(found, failure, client); });
  });
  return {};
}

// The optimiser's result, on the io thread.
void PlanChanges::take(std::optional<Plan> found, const std::string& failure, const std::string& client) {
  is_optimising_ = false;
  std::string why = failure;
  if (why.empty()) why = refusal();
  if (why.empty() && run_at_start_ != state_->summary.run) why = "the simulation was started again meanwhile";
  if (why.empty() && begun() != begun_at_start_) why = "seeds have fallen meanwhile: ask again";
  if (why.empty() && found->needles.empty()) why = "no further seed improves the implant";
  try {
    if (why.empty())
      change_to(ledger_->with_rest(begun_at_start_, *found), PlanChangeKind::kOptimised, client);
  } catch (const UserError& e) {
    why = e.what();
  }
  if (why.empty()) return;
  announce(net::EventKind::kWarning, "the plan stays: " + why);
  publish();
}

void PlanChanges::change_to(const Plan& whole, PlanChangeKind kind, const std::string& client) {
  PlanLedger changed = *ledger_;
  changed.change_to(whole);
  const std::string by = std::string(to_string(kind)) + " by " + client;
  if (changes_) changes_->add(session_start_s_ + state_->summary.sim_time_s, changed.in_use(), kind, by);
  ledger_ = std::move(changed);
  kind_ = kind == PlanChangeKind::kOptimised ? net::PlanKind::kOptimised : net::PlanKind::kEdited;
  by_ = by;
  hand_over();
  const Plan rest = ledger_->rest(begun());
  announce(net::EventKind::kNote, fmt::format("plan {}: {} needles with {} seeds are left", by,
                                              rest.needles.size(), rest.seed_count()));
  publish();
}

void PlanChanges::hand_over() {
  for (auto* to : {&to_simulator_, &to_dose_, &to_events_}) {
    to->writer.slot() = ledger_->loading();
    to->writer.publish();
  }
}

void PlanChanges::publish() {
  net::PlanMessage message;
  message.kind = kind_;
  message.is_optimising = is_optimising_;
  message.change = static_cast<std::uint32_t>(ledger_->changes());
  message.air_kerma_strength_u = ledger_->all().air_kerma_strength_u;
  message.by = by_;
  begun_published_ = state_ ? begun() : ledger_->begun({}, lost_);
  std::uint32_t first = 0;
  for (std::size_t n = 0; n < ledger_->all().needles.size(); ++n) {
    const PlanNeedle& needle = ledger_->all().needles[n];
    if (!ledger_->is_withdrawn(n))
      message.needles.push_back({static_cast<std::uint16_t>(n), begun_published_[n] != 0, first,
                                 ledger_->depth_mm(n), needle.hole, needle.train});
    first += static_cast<std::uint32_t>(needle.seed_offsets_mm().size());
  }
  server_.publish(message);
}

const PlanNeedle* PlanChanges::needle(std::uint16_t number) const {
  if (!ledger_ || number >= ledger_->all().needles.size() || ledger_->is_withdrawn(number)) return nullptr;
  return &ledger_->all().needles[number];
}

std::string PlanChanges::no_needle(std::uint16_t number) const {
  if (number < ledger_->all().needles.size())
    return fmt::format("needle {} is no longer planned: PLAN names those in use", number);
  return fmt::format("the plan has no needle {}: they are 0 to {}", number,
                     ledger_->all().needles.size() - 1);
}

void PlanChanges::on_snapshot(const std::shared_ptr<const MeshState>& state) {
  if (!ledger_) return;
  const bool is_reset = state_ && state->summary.tick < state_->summary.tick;
  state_ = state;
  if (is_reset) restart();
  visit_new(state->failed_drops, failed_seen_, [&](const FailedDrop& drop) {
    if (drop.why == DropRefusal::kLost && drop.planned >= 0) lost_.push_back(drop.planned);
  });
  if (begun() != begun_published_) publish();
}

void PlanChanges::restart() {
  lost_.clear();
  failed_seen_ = 0;
  if (ledger_->changes() == 0) return;
  ledger_ = first_;
  kind_ = net::PlanKind::kFile;
  by_ = std::filesystem::path(scene_.plan_file).filename().string();
  hand_over();
  publish();
}

void PlanChanges::announce(net::EventKind kind, const std::string& text) {
  log_(text);
  server_.broadcast({kind, 0, state_ ? state_->summary.tick : 0, text});
}

}  // namespace brachy
