#include "apps/daemon/control/plan_changes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <set>

#include "core/base/error.h"
#include "core/base/one_line.h"
#include "core/brachytherapy/plan/change/hole_loading.h"
#include "core/brachytherapy/plan/hole_names.h"
#include "core/brachytherapy/plan/optimiser/optimise_plan.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/simulation/new_failed_drops.h"
#include "net/server/server.h"

namespace brachy {
namespace {

constexpr std::uint64_t kOptimiser = 0;  // WorkTurns' number of it: clients are counted from 1

/// Seeds that one change may add to a plan that has `had`: a quarter of what is left, so that no few large changes
/// leave none for those after them, and those of a usual plan while there are.
std::size_t most_added(std::size_t had) {
  constexpr std::size_t kUsualPlan = 200;
  return std::max(kUsualPlan, (LoadingPlan::kMostSeeds - std::min(had, LoadingPlan::kMostSeeds)) / 4);
}

/// What can be said of drawn needles without looking at the gland: as much work as the template has holes.
std::string refusal_of_drawn(const net::PlanMessage& request, const TemplateGrid& grid) {
  const auto holes = static_cast<std::size_t>(grid.columns * grid.rows);
  if (request.needles.size() > holes)
    return fmt::format("{} needles are more than the template has holes, {}", request.needles.size(), holes);
  std::set<std::pair<double, double>> taken;
  for (const net::PlanMessageNeedle& drawn : request.needles) {
    const std::string where = "hole " + one_short_line(drawn.hole) + ": ";
    const std::optional<Vec3> position = grid.position(drawn.hole);
    if (!position) return where + grid.lacks(drawn.hole);
    if (!taken.emplace(position->x(), position->y()).second)
      return where + "it is there for the second time; use each hole once";
    if (!std::isnan(drawn.depth_mm) && !std::isfinite(drawn.depth_mm))
      return where + "its depth is not finite";
  }
  return {};
}

}  // namespace

std::optional<PlanLedger> plan_ledger(const Scene& scene, const std::optional<Plan>& plan,
                                      const std::optional<SessionFolder>& session) {
  if (!plan) return std::nullopt;
  PlanLedger ledger(*plan, scene.template_grid, scene.needle.length_mm);
  if (!session) return ledger;
  for (const PlanChange& change : load_plan_changes(*session))
    ledger.change_to(parse_plan_toml(session->read(change.file).value_or(""),
                                     session->path_of(change.file).string(), scene.template_grid,
                                     scene.needle.length_mm));
  return ledger;
}

PlanChanges::PlanChanges(const Scene& scene, const std::vector<Structure>& structures,
                         std::optional<PlanLedger> ledger, std::optional<SessionFolder> session,
                         double session_start_s, std::vector<std::int32_t> lost, EventLoop& loop,
                         SimulationRuns& runs, net::Server& server, const std::function<void()>& start,
                         std::function<void(const std::string&)> log)
    : scene_(scene),
      structures_(structures),
      first_(ledger ? std::make_shared<const Version>(*std::move(ledger)) : nullptr),
      plan_(first_),
      session_start_s_(session_start_s),
      loop_(loop),
      runs_(runs),
      server_(server),
      log_(std::move(log)),
      by_(std::filesystem::path(scene.plan_file).filename().string()),
      lost_(std::move(lost)),
      to_simulator_(plan_ ? plan_->loading : LoadingPlan()),
      to_dose_(to_simulator_.reader.value()),
      to_events_(to_simulator_.reader.value()) {
  optimiser_.post(start);
  editor_.post(start);
  if (!plan_) return;
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

void PlanChanges::stop() {
  optimiser_.stop();
  editor_.stop();
}

std::string PlanChanges::execute(net::PlanMessage request, const net::Sender& from) {
  const bool is_edit = request.kind == net::PlanKind::kEdited;
  if (!is_edit && request.kind != net::PlanKind::kOptimised)
    return fmt::format("there is no request {}: 2 optimise the rest, 3 the rest is to be these needles",
                       static_cast<unsigned>(request.kind));
  if (std::string why = refusal(request, from.id); !why.empty()) return why;
  if (!is_edit) return optimise(from);
  const TemplateGrid on_wire = scene_.template_grid.named_as_on_wire();
  if (std::string why = refusal_of_drawn(request, on_wire); !why.empty()) return why;
  rename_holes(request.needles, on_wire, scene_.template_grid);
  return edit(std::make_shared<const net::PlanMessage>(std::move(request)), from);
}

std::string PlanChanges::no_plan() const {
  return scene_.implant.is_hdr() ? "catheters of an afterloader carry no seeds: there is no plan of such"
                                 : "there is no plan: give the scene plan.file";
}

/// Why no plan may be changed now, whoever asks; "": it may.
std::string PlanChanges::refusal() const {
  if (!plan_) return no_plan();
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

std::string PlanChanges::refusal(const net::PlanMessage& request, std::uint64_t client) const {
  // Another's edit goes before the result, but not twice in a row: neither keeps the other out.
  const bool goes_first =
      request.kind == net::PlanKind::kEdited && client != optimised_for_.id && client != dropped_by_;
  if (is_optimising_ && !goes_first) return "the rest is being optimised: wait for the result";
  if (std::string why = refusal(); !why.empty()) return why;
  const std::size_t changes = plan_->ledger.changes();
  if (request.change != changes)
    return fmt::format("the plan has changed meanwhile: this request goes on from change {}, and it is at {}",
                       request.change, changes);
  return {};
}

std::vector<char> PlanChanges::begun() const {
  return plan_->ledger.begun(state_ ? state_->seeds.in_tissue() : std::span<const Seed>(), lost_);
}

std::string PlanChanges::edit(const std::shared_ptr<const net::PlanMessage>& request,
                              const net::Sender& from) {
  const bool is_taken = turns_.add(from.id, [this, request, from]() -> WorkTurns::Work {
    if (const std::string why = refusal(*request, from.id); !why.empty()) {
      from.refuse(why);
      return nullptr;
    }
    return change(
        [this, request, is_begun = begun()](const PlanLedger& ledger) {
          return ledger.with_rest(is_begun, drawn_plan(*request, ledger.all()));
        },
        PlanChangeKind::kEdited, from, from.refuse);
  });
  return is_taken ? "" : "your last change of the plan is still being made: wait for its PLAN";
}

/// The rest that an operator drew; what is left open is loaded by the rule. On the editor's thread.
Plan PlanChanges::drawn_plan(const net::PlanMessage& request, const Plan& like) {
  Plan rest = like;
  rest.needles.clear();
  std::vector<double> depths;
  for (const net::PlanMessageNeedle& drawn : request.needles) {
    PlanNeedle needle{drawn.hole, 0, drawn.train};
    double depth = drawn.depth_mm;
    if (std::isnan(depth) || needle.train.empty()) {
      if (!holes_) holes_ = find_gland_holes(structures_, scene_.template_grid);
      const HoleLoading loading = load_hole(*holes_, scene_.template_grid, drawn.hole);
      if (std::isnan(depth)) depth = loading.depth_mm;
      if (needle.train.empty()) needle.train = loading.train;
    }
    depths.push_back(depth);
    rest.needles.push_back(std::move(needle));
  }
  for (const double depth : depths) rest.base_plane_mm = std::max(rest.base_plane_mm, depth);
  for (std::size_t n = 0; n < depths.size(); ++n)
    rest.needles[n].retraction_mm = rest.base_plane_mm - depths[n];
  return rest;
}

std::string PlanChanges::optimise(const net::Sender& from) {
  begun_at_start_ = begun();
  run_at_start_ = state_->summary.run;
  bool has_needles = false, has_rest = false;
  for (std::size_t n = 0; n < begun_at_start_.size(); ++n) {
    has_needles |= plan_->loading.is_in_use(n);
    has_rest |= plan_->loading.is_in_use(n) && !begun_at_start_[n];
  }
  if (!has_rest)
    return has_needles ? "no needle of the plan is left: all have left seeds"
                       : "the plan has no needle: draw those that are to be optimised";
  is_optimising_ = true;
  optimised_for_ = from;
  ++optimiser_runs_;
  publish();
  optimiser_.post([this, from, number = ++optimisation_, plan = plan_, state = state_, lost = lost_,
                   goals = scene_.goals, is_begun = begun_at_start_] {
    const PlanLedger& ledger = plan->ledger;
    OptimiserSettings how = replan_settings();
    for (std::size_t n = 0; n < is_begun.size(); ++n)
      if (is_begun[n]) how.forbidden_holes.push_back(ledger.all().needles[n].hole);
    how.objective.add_goals(goals);
    std::optional<Plan> found;
    std::string failure;
    try {
      found = replan(structures_, scene_.template_grid, ledger.rest(is_begun),
                     ledger.placed(state->seeds.in_tissue(), lost), scene_.needle.length_mm, how)
                  .plan;
      if (found->needles.empty()) failure = "no further seed improves the implant";
    } catch (const std::exception& e) {
      failure = e.what();
    }
    loop_.post([this, number, found = std::move(found), failure, from] {
      --optimiser_runs_;
      take(number, found, failure, from);
    });
  });
  return {};
}

// The optimiser's result, on the io thread.
void PlanChanges::take(std::uint64_t optimisation, std::optional<Plan> found, std::string failure,
                       const net::Sender& from) {
  if (!is_optimising_ || optimisation != optimisation_) return;  // an edit went before it
  if (!failure.empty()) return end_optimisation(failure);
  turns_.add(kOptimiser, [this, optimisation, rest = *std::move(found), from]() -> WorkTurns::Work {
    if (!is_optimising_ || optimisation != optimisation_) return nullptr;
    std::string why = refusal();
    if (why.empty() && run_at_start_ != state_->summary.run)
      why = "the simulation was started again meanwhile";
    if (why.empty() && begun() != begun_at_start_) why = "seeds have fallen meanwhile: ask again";
    if (!why.empty()) {
      end_optimisation(why);
      return nullptr;
    }
    return change(
        [rest, is_begun = begun_at_start_](const PlanLedger& ledger) {
          return ledger.with_rest(is_begun, rest);
        },
        PlanChangeKind::kOptimised, from, [this](const std::string& what) { end_optimisation(what); });
  });
}

/// Without a result.
void PlanChanges::end_optimisation(const std::string& failure) {
  is_optimising_ = false;
  dropped_by_ = 0;
  announce(net::EventKind::kWarning, "the plan stays: " + failure);
  publish();
}

/// Makes the next version of the plan, and writes it into the session.
WorkTurns::Work PlanChanges::change(MakePlan make, PlanChangeKind kind, const net::Sender& from,
                                    std::function<void(const std::string&)> refuse) {
  const double t_s = session_start_s_ + state_->summary.sim_time_s;
  return [=, this, before = plan_, is_begun = begun()]() -> WorkTurns::Finish {
    try {
      PlanLedger ledger = before->ledger;
      ledger.change_to(make(ledger));
      const std::size_t had = before->ledger.all().seed_count(), added = ledger.all().seed_count() - had;
      if (added > most_added(had))
        throw UserError(fmt::format("the needles that are new have {} seeds, and one change adds at most {}",
                                    added, most_added(had)));
      const auto changed = std::make_shared<const Version>(std::move(ledger));
      std::vector<char> begun_of_all = is_begun;
      begun_of_all.resize(changed->ledger.all().needles.size(), 0);  // those that are new are not
      const Plan rest = changed->ledger.rest(begun_of_all);
      auto loading = std::make_shared<std::array<LoadingPlan, 3>>();
      loading->fill(changed->loading);
      if (changes_)
        changes_->add(t_s, changed->ledger.in_use(), scene_.template_grid, kind,
                      std::string(to_string(kind)) + " by " + from.name);
      return [=, this] {
        if (plan_ != before) return refuse("the simulation was started again meanwhile");
        hand_over(std::move(*loading));
        put_in_use(changed, rest, kind, from);
      };
    } catch (const std::exception& e) {
      return [refuse, why = std::string(e.what())] { refuse(why); };
    }
  };
}

void PlanChanges::put_in_use(const VersionPtr& changed, const Plan& rest, PlanChangeKind kind,
                             const net::Sender& from) {
  plan_ = changed;
  const bool is_edit = kind == PlanChangeKind::kEdited;
  kind_ = is_edit ? net::PlanKind::kEdited : net::PlanKind::kOptimised;
  by_ = std::string(to_string(kind)) + " by " + from.name;
  announce(net::EventKind::kNote, fmt::format("plan {}: {} needles with {} seeds are left", by_,
                                              rest.needles.size(), rest.seed_count()));
  const bool was_optimising = std::exchange(is_optimising_, false);
  dropped_by_ = is_edit && was_optimising ? from.id : 0;
  if (dropped_by_)
    announce(net::EventKind::kWarning, "what was optimised for " + optimised_for_.name +
                                           " is not used: the plan was " + by_ + " before; ask again");
  publish();
}

void PlanChanges::hand_over(std::array<LoadingPlan, 3> loading) {
  std::size_t next = 0;
  for (auto* to : {&to_simulator_, &to_dose_, &to_events_}) {
    to->writer.slot() = std::move(loading[next++]);
    to->writer.publish();
  }
}

void PlanChanges::publish() {
  const PlanLedger& ledger = plan_->ledger;
  net::PlanMessage message;
  message.kind = kind_;
  message.is_optimising = is_optimising_;
  message.change = static_cast<std::uint32_t>(ledger.changes());
  message.air_kerma_strength_u = ledger.all().air_kerma_strength_u;
  message.by = by_;
  begun_published_ = begun();
  for (std::size_t n = 0; n < ledger.all().needles.size(); ++n) {
    const PlanNeedle& needle = ledger.all().needles[n];
    if (!ledger.is_withdrawn(n))
      message.needles.push_back({static_cast<std::uint16_t>(n), begun_published_[n] != 0,
                                 static_cast<std::uint32_t>(plan_->loading.first_of_needle[n]),
                                 ledger.depth_mm(n), needle.hole, needle.train});
  }
  rename_holes(message.needles, scene_.template_grid, scene_.template_grid.named_as_on_wire());
  server_.publish(message);
}

const PlanNeedle* PlanChanges::needle(std::uint16_t number) const {
  if (!plan_ || number >= plan_->loading.needle_count() || !plan_->loading.is_in_use(number)) return nullptr;
  return &plan_->ledger.all().needles[number];
}

std::string PlanChanges::no_needle(std::uint16_t number) const {
  if (number < plan_->loading.needle_count())
    return fmt::format("needle {} is no longer planned: PLAN names those in use", number);
  return fmt::format("the plan has no needle {}: they are 0 to {}", number,
                     plan_->loading.needle_count() - 1);
}

void PlanChanges::on_snapshot(const std::shared_ptr<const MeshState>& state) {
  if (!plan_) return;
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
  if (plan_ == first_) return;
  plan_ = first_;
  kind_ = net::PlanKind::kFile;
  by_ = std::filesystem::path(scene_.plan_file).filename().string();
  hand_over({first_->loading, first_->loading, first_->loading});
  publish();
}

void PlanChanges::announce(net::EventKind kind, const std::string& text) {
  log_(text);
  server_.broadcast({kind, 0, state_ ? state_->summary.tick : 0, text});
}

}  // namespace brachy
