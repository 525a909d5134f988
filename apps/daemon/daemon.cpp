#include "apps/daemon/daemon.h"

#include <fmt/format.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <future>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "apps/daemon/control/controls.h"
#include "apps/daemon/control/plan_changes.h"
#include "apps/daemon/control/scanner_console.h"
#include "apps/daemon/control/scene_reload.h"
#include "apps/daemon/control/volume_studies.h"
#include "apps/daemon/daemon_setup.h"
#include "apps/daemon/display/shown_volume.h"
#include "apps/daemon/exercise/exercise_pages.h"
#include "apps/daemon/exercise/session_pages.h"
#include "apps/daemon/forces/force_cycle.h"
#include "apps/daemon/forces/pose_notices.h"
#include "apps/daemon/forces/safety_notices.h"
#include "apps/daemon/io/event_loop.h"
#include "apps/daemon/loops/deformation_loop.h"
#include "apps/daemon/loops/fraction_loop.h"
#include "apps/daemon/loops/simulation_runs.h"
#include "apps/daemon/loops/snapshot_loop.h"
#include "apps/daemon/loops/ultrasound_loop.h"
#include "apps/daemon/network_log.h"
#include "apps/daemon/recorded_session.h"
#include "apps/daemon/scene_message.h"
#include "apps/daemon/service/service_watch.h"
#include "apps/daemon/session_recorder.h"
#include "apps/daemon/telemetry/metrics_text.h"
#include "apps/daemon/telemetry/telemetry.h"
#include "apps/daemon/telemetry/tick_events.h"
#include "core/base/error.h"
#include "core/realtime/capabilities.h"
#include "core/realtime/hand_over.h"
#include "core/realtime/realtime_thread.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_structures.h"
#include "core/scene/load_ultrasound.h"
#include "net/broker/broker_options.h"
#include "net/http/http_listener.h"
#include "net/igtl/igtl_server.h"
#include "net/server/server.h"

namespace brachy {
namespace {

std::unique_ptr<RecordedSession> open_session(const Scene& scene, const DaemonOptions& options,
                                              const SessionPlan& plan,
                                              const std::vector<Structure>& structures) {
  if (!options.session) return nullptr;
  return std::make_unique<RecordedSession>(*options.session, scene, plan,
                                           names_of(tested_organs(structures)));
}

/// A scene with what its files hold, and the session that is recorded of it.
struct LoadedScene {
  LoadedScene(const Scene& of, const DaemonOptions& options)
      : scene(of),
        plan(load_plan(of)),
        hdr_plan(load_hdr_plan(of)),
        structures(load_structures(of)),
        echoes(of.ultrasound.on && !of.ultrasound.volume.empty() ? load_echo_map(of, structures) : nullptr),
        session(open_session(of, options, {plan, hdr_plan}, structures)),
        ledger(plan_ledger(of, plan, session ? std::optional(session->folder()) : std::nullopt)) {}

  std::vector<std::int32_t> lost_seeds() const {
    return session ? session->restored_lost() : std::vector<std::int32_t>();
  }
  DoseSettings dose_settings() const {
    DoseSettings settings = scene.dose;
    if (plan) settings.prescription_gy = plan->prescription_gy;
    return settings;
  }

  const Scene scene;
  const std::optional<Plan> plan;
  const std::optional<HdrPlan> hdr_plan;
  const std::vector<Structure> structures;
  /// A volume that cannot be used is reported at once. Null: it is made at the first demand.
  const std::shared_ptr<const EchoMap> echoes;
  const std::unique_ptr<RecordedSession>
      session;                             ///< snapshot thread; its sync() the dose thread; null: none
  const std::optional<PlanLedger> ledger;  ///< at the start; none: there is no plan
};

std::shared_ptr<SimulationRun> first_run(const LoadedScene& loaded, const DaemonOptions& options) {
  auto run = std::make_shared<SimulationRun>(
      0, false, load_simulation_model(loaded.scene, load_simulated_tissue(loaded.scene), options.set_up));
  if (loaded.ledger) run->simulator.set_plan(loaded.ledger->loading());
  if (loaded.session) {
    if (!loaded.session->restored().empty()) run->simulator.restore_seeds(loaded.session->restored());
    run->simulator.restore_lost(loaded.session->restored_lost());
  }
  return run;
}

/// What the threads hand each other.
struct HandOvers {
  HandOvers(const Simulator& simulator, std::size_t needles, bool keeps_states)
      : states(simulator.initial_state()),
        seeds(DroppedSeeds(simulator.initial_state())),
        forces(TickForces(needles)),
        imaged_ticks(ImagedTick(simulator, simulator.initial_state())),
        dosed_ticks(ImagedTick(simulator, simulator.initial_state())) {
    if (keeps_states) saves.emplace(SavedTick(simulator));
  }

  // From the deformation thread:
  HandOver<MeshState> states;                // to the snapshot thread
  std::optional<HandOver<SavedTick>> saves;  // to the snapshot thread, where a session keeps them
  HandOver<DroppedSeeds> seeds;              // to the dose thread
  HandOver<TickForces> forces;               // to the io thread
  HandOver<LoopStatistics> loop;             // to the io thread
  HandOver<ImagedTick> imaged_ticks;         // to the ultrasound thread
  HandOver<ImagedTick> dosed_ticks;          // to the dose thread of HDR
  HandOver<LoopStatistics> control;          // from the control thread to the io thread
  HandOver<RunModel> models;                 // from the io thread to the ultrasound thread
  HandOver<RunModel> dosed_models;           // from the io thread to it
  std::array<HandOver<ScannedImage>, UltrasoundScanner::kMostViews> images;  // back
  HandOver<UltrasoundStatistics> ultrasound;                                 // likewise
};

std::vector<Vec3> surface_vertices(const Tissue& tissue) {
  const auto first = tissue.rest_vertices.begin();
  return {first, first + static_cast<std::ptrdiff_t>(tissue.surface_count)};
}

/// The name that top -H and ps -L show.
void name_thread(const char* name) {
  pthread_setname_np(pthread_self(), name);
}

/// Behind the others where processors are short.
void stand_back() {
  constexpr int kNice = 5;
  setpriority(PRIO_PROCESS, 0, kNice);  // on Linux, of the calling thread
}

/// First work of a thread that clients can make busy: where processors are short the others go first.
std::function<void()> as_background_thread(const char* name) {
  return [name] {
    name_thread(name);
    drop_capabilities();
    stand_back();
  };
}

PoseFault fault_of(net::StrayPose stray) {
  switch (stray) {
    case net::StrayPose::kTooMany:
      return PoseFault::kTooMany;
    case net::StrayPose::kUnseen:
      return PoseFault::kUnseen;
    case net::StrayPose::kForeign:
      break;
  }
  return PoseFault::kForeign;
}

/// As the lease of its needle has it.
std::string text_of(const net::DeviceInfo& device) {
  return device.name + " (" + device.address + ")";
}

/// The thread of TLS handshakes, which anybody can cause; null: no TLS.
std::unique_ptr<Worker> make_handshake_thread(const Scene& scene) {
  if (!scene.server.has_tls()) return nullptr;
  auto thread = std::make_unique<Worker>();
  thread->post(as_background_thread("handshake"));
  return thread;
}

}  // namespace

class Daemon::Impl {
 public:
  Impl(const Scene& scene, const DaemonOptions& options, net::TimerClock& clock)
      : options_(options),
        broker_(broker_options(scene, options)),
        loaded_(scene, options),
        loop_(clock),
        runs_(first_run(loaded_, options), loop_, worker_),
        devices_(make_devices(scene, simulator().tissue(), scene.instrument_count())),
        X_WR_(resting_probe(scene, simulator().tissue())),
        hand_overs_(simulator(), devices_.size(), loaded_.session != nullptr),
        events_(
            simulator().initial_state(),
            loaded_.ledger ? loaded_.ledger->all().seeds(scene.template_grid) : std::vector<PlannedSeed>(),
            names_of(simulator().model()->organs)),
        handshakes_(make_handshake_thread(scene)),
        server_(loop_.io(), own_server_options(), simulator().tissue(), server_handlers()) {
    spdlog::info("engine: {}, {} thread{}", to_string(simulator().simd_target()), scene.engine.threads,
                 scene.engine.threads == 1 ? "" : "s");
    server_.set_scene(make_scene_message(scene, loaded_.plan, loaded_.structures));
    wire();
    // Last: a start that is refused changes nothing in the session's directory.
    if (loaded_.session && !options.check_config) begin_session();
  }

  ~Impl() {
    worker_.end();  // what it builds refers to members that are destroyed next
  }

  DaemonSummary run() {
    end_signals_.start([this](int number) {
      spdlog::info("signal {}: ending", number);
      end();
    });
    if (options_.duration_s)
      duration_->start(std::chrono::nanoseconds(std::llround(*options_.duration_s * 1e9)), [this] { end(); });
    if (igtl_) follow_ticks();
    if (options_.report_every_s) telemetry_->start_reports(*options_.report_every_s, options_.json);

    DaemonSummary summary;
    const std::int64_t start_ns = loop_.clock().now_ns();
    std::vector<Vec3> surface = surface_vertices(simulator().tissue());
    std::promise<std::string> granted;
    std::jthread deformation([&](const std::stop_token& stop) {
      name_thread("deformation");
      const RealtimeGrant grant =
          request_realtime({scene().realtime.fifo_priority, scene().realtime.lock_memory});
      drop_capabilities();
      granted.set_value(to_string(grant));
      std::vector<Device*> devices;
      for (const auto& device : devices_) devices.push_back(device.get());
      run_deformation_loop(stop, loop_.clock(), runs_.in_use(),
                           {runs_.reader(),
                            devices,
                            hand_overs_.states.writer,
                            hand_overs_.forces.writer,
                            hand_overs_.seeds.writer,
                            hand_overs_.loop.writer,
                            &changes_->for_simulator(),
                            {has_ultrasound() ? &hand_overs_.imaged_ticks.writer : nullptr,
                             loaded_.hdr_plan ? &hand_overs_.dosed_ticks.writer : nullptr},
                            hand_overs_.saves ? &hand_overs_.saves->writer : nullptr,
                            ticks_per_state(scene().period_s())});
    });
    std::jthread control;
    if (options_.control_thread || scene().realtime.control_thread)
      control = std::jthread([&](const std::stop_token& stop) {
        name_thread("control");
        request_realtime(
            {scene().realtime.fifo_priority, false});  // the same scheduling as the deformation thread
        drop_capabilities();
        run_control_loop(stop, loop_.clock(), scene().period_s(), hand_overs_.control.writer);
      });
    // Only those two threads need capabilities. Threads that this one creates from here on inherit none.
    drop_capabilities();
    worker_.post([] {
      name_thread("worker");
      drop_capabilities();
    });
    std::jthread snapshots([&](const std::stop_token& stop) {
      name_thread("snapshot");
      summary.snapshots =
          run_snapshot_loop(stop, loop_.clock(), scene().rates.snapshot_hz, hand_overs_.states.reader,
                            [&](auto state) { deliver(std::move(state)); });
    });
    std::jthread dose([&](const std::stop_token& stop) {
      name_thread("dose");
      const auto deliver = [&](net::DoseMessage message) { deliver_dose(std::move(message)); };
      if (loaded_.hdr_plan) {
        stand_back();
        run_fraction_loop(stop, loop_.clock(), scene(), *loaded_.hdr_plan, loaded_.structures, surface,
                          {hand_overs_.dosed_ticks.reader, hand_overs_.dosed_models.reader, deliver,
                           [this](const std::vector<CatheterCourse>& catheters) {
                             if (loaded_.session) loaded_.session->keep(catheters);
                           }});
        return;
      }
      summary.dose =
          run_dose_loop(stop, loop_.clock(), loaded_.structures, loaded_.dose_settings(), std::move(surface),
                        {changes_->for_dose(), loaded_.lost_seeds()}, hand_overs_.seeds.reader, deliver);
    });
    std::jthread ultrasound;
    if (has_ultrasound())
      ultrasound = std::jthread([&](const std::stop_token& stop) {
        name_thread("ultrasound");
        stand_back();
        run_ultrasound_loop(stop, loop_.clock(), scene(), loaded_.structures, loaded_.echoes, X_WR_,
                            ultrasound_ports());
      });
    std::jthread broker;
    if (publisher_)
      broker = std::jthread([&](const std::stop_token& stop) {
        const std::stop_callback stop_publisher(stop, [&] { publisher_->stop(); });
        publisher_->run();
      });
    summary.realtime = granted.get_future().get();
    if (scene().realtime.fifo_priority || scene().realtime.lock_memory) spdlog::info("{}", summary.realtime);
    watch_->begin();

    loop_.run();
    worker_.stop();  // a simulator that it still builds, which may take seconds, is not needed any more
    exercises_->stop();
    if (teacher_) teacher_->stop();
    changes_->stop();
    summary.is_worker_busy = runs_.is_building() || reload_->is_running() || exercises_->is_busy() ||
                             changes_->is_busy() || (teacher_ && teacher_->is_busy());

    // The deformation thread first: its last tick is then in the last snapshot.
    for (std::jthread* thread : {&deformation, &snapshots, &dose, &ultrasound, &control, &broker}) {
      thread->request_stop();
      if (thread->joinable()) thread->join();
    }
    // A signal that came meanwhile ends it for good.
    if (next_) {
      end_signals_.start([this](int) { next_.reset(); });
      loop_.run_ready();
      end_signals_.cancel();
    }
    summary.next = next_;
    summary.elapsed_s = 1e-9 * static_cast<double>(loop_.clock().now_ns() - start_ns);
    finish(summary);
    return summary;
  }

  void stop() {
    loop_.post([this] { end(); });
  }

 private:
  friend Daemon;

  const Scene& scene() const { return loaded_.scene; }
  Simulator& simulator() { return runs_.in_use().simulator; }
  bool has_ultrasound() const { return scene().ultrasound.on; }
  bool is_probe(std::size_t needle) const {
    return scene().probe.on && needle == std::size_t(scene().needle.count);
  }
  NetworkDevice& network_device(std::size_t needle) { return devices_[needle]->network(); }

  // --- wiring ---

  /// Makes the parts of the io thread, each after those that it uses. Each registers for what it has to do: requests of
  /// clients, snapshots, pages, and the end.
  void wire() {
    at_end_.push_back([this] { server_.stop(why_it_ends()); });
    add_forces();
    add_controls();
    add_plan();
    add_probe();
    if (has_ultrasound()) add_ultrasound();
    runs_.on_model = [this](std::uint64_t run, const auto& model) { publish_model(run, model); };
    publish_model(0, simulator().model());
    add_service();
    add_telemetry();
    add_exercises();
    add_http();
    if (broker_) publisher_.emplace(loop_.io(), server_, *broker_, log_);
    add_igtl();
  }

  /// `execute` carries out a request of clients. It returns "", or the reason why not.
  template <class Message, class Execute>
  void on_request(Execute execute) {
    server_.requests().set<Message>(
        [this, execute = std::move(execute)](Message& message, const net::Sender& from) -> std::string {
          return is_ending_ ? "the daemon is ending" : execute(message, from);
        });
  }

  void add_forces() {
    ForceLinkOutputs o;
    o.send_force = [this](const net::ForceMessage& message) { server_.send(message.needle, message); };
    o.send_model = [this](const net::LocalModelMessage& message) { server_.send(message.needle, message); };
    o.round_trip_s = [this](std::uint16_t needle) { return server_.round_trip_s(needle); };
    o.announce = [this](const net::EventMessage& event) { safety_.add(event); };
    forces_.emplace(loop_, hand_overs_.forces.reader, devices_.size(), std::move(o),
                    [this](const TickForces& tick) { on_tick(tick); });
    server_.requests().set<net::ArmMessage>(
        [this](const auto& arm, const auto& from) { forces_->link().arm(arm.needle, from.name); });
    server_.requests().set<net::DropMessage>(
        [this](const auto& drop, const auto&) { network_device(drop.needle).press(drop.pressed); });
    at_end_.push_back([this] { forces_->stop(); });
  }

  void add_controls() {
    controls_.emplace(scene(), devices_, runs_, server_, log_, loaded_.session != nullptr);
    on_request<net::ControlMessage>(
        [this](const auto& message, const auto& from) { return controls_->execute(message, from); });
    on_snapshot_.push_back([this](const auto& state) { controls_->on_snapshot(state->summary.run); });
    if (scene().device.kind != "scripted" && !options_.play) return;
    if (const std::string refusal = controls_->play(scene().device.loop || options_.play); !refusal.empty())
      throw UserError(refusal);
  }

  void add_plan() {
    changes_.emplace(scene(), loaded_.structures, loaded_.ledger,
                     loaded_.session ? std::optional(loaded_.session->folder()) : std::nullopt,
                     loaded_.session ? loaded_.session->start_s() : 0, loaded_.lost_seeds(), loop_, runs_,
                     server_, as_background_thread("plan"), log_);
    on_request<net::PlanMessage>(
        [this](auto& message, const auto& from) { return changes_->execute(std::move(message), from); });
    on_request<net::LoadMessage>(
        [this](const auto& message, const auto& from) { return load(message, from.name); });
    on_snapshot_.push_back([this](const auto& state) { changes_->on_snapshot(state); });
  }

  void add_probe() {
    SwitchedDevice* const probe = scene().probe.on ? devices_.back().get() : nullptr;
    if (probe) probe->add_stepper(X_WR_);
    console_.emplace(scene(), probe, [this](const net::ScannerMessage& message) {
      server_.publish(message);
      if (igtl_) igtl_->set_scanner(message);
    });
  }

  void add_ultrasound() {
    VolumeStudies::Store store;
    if (loaded_.session)
      store = [this](RecordedStudy study) { return loaded_.session->store(std::move(study)); };
    studies_.emplace(loop_, worker_, loaded_.structures.front().mesh, scene().period_s(), std::move(store),
                     [this](const std::string& text) {
                       log_(text);
                       server_.broadcast({net::EventKind::kWarning, 0, 0, text});
                     });
    on_request<net::ScannerMessage>(
        [this](const auto& message, const auto&) { return console_->execute(message); });
    on_request<net::ContourMessage>(
        [this](auto& message, const auto& from) { return studies_->execute(std::move(message), from); });
    on_snapshot_.push_back(
        [this](const auto& state) { console_->update(image_demand(), state->summary.tick); });
  }

  /// What the service manager watches, and asks for.
  void add_service() {
    watch_.emplace(
        loop_, scene().period_s(),
        ServiceWatch::Handlers{[this] { forces_->update(); }, [this] { return telemetry_->status(); }});
    reload_.emplace(loop_, worker_, *controls_, *watch_, options_);
    on_snapshot_.push_back([this](const auto&) { reload_->begin_if_requested(); });
    at_end_.push_back([this] { reload_->stop(); });
    at_end_.push_back(
        [this] { watch_->end(next_ ? ServiceWatch::End::kGoesOn : ServiceWatch::End::kStops); });
  }

  void add_telemetry() {
    telemetry_.emplace(loop_,
                       Telemetry::Sources{hand_overs_.loop.reader, hand_overs_.control.reader, server_, runs_,
                                          std::as_const(*forces_).link(), *controls_, *reload_, *watch_,
                                          [this] { return igtl_figures(); }, hand_overs_.ultrasound.reader});
    pages_.merge(telemetry_->pages());
    on_snapshot_.push_back([this](const auto& state) { telemetry_->set_seed_count(state->seeds.count); });
    at_end_.push_back([this] { telemetry_->stop_reports(); });
  }

  void add_exercises() {
    std::function<ScoredSession()> score;
    if (loaded_.session) score = [this] { return loaded_.session->score(); };
    exercises_.emplace(loop_, options_.config, options_.sessions, std::move(score),
                       as_background_thread("score"));
    pages_.merge(exercises_->pages());
    add_debrief();
    on_request<net::ExerciseMessage>(
        [this](const auto& message, const auto& from) { return go_on_with(message, from.name); });
  }

  /// The teacher's pages, and what a debrief plays: of attempts alone, which are short.
  void add_debrief() {
    if (!options_.sessions) return;
    teacher_.emplace(loop_, *options_.sessions, as_background_thread("sessions"));
    pages_.merge(teacher_->pages());
    recorder_.emplace(loop_, server_, as_background_thread("recorder"), [this](const std::string& why) {
      spdlog::warn("session: {}", why);
      server_.broadcast({net::EventKind::kWarning, 0, 0, why});
    });
    at_end_.push_back([this] { recorder_->stop(); });
  }

  void add_http() {
    const int port = options_.http_port.value_or(scene().server.http_port);
    if (port < 0) return;
    pages_["/volume"] = volume_page(scene());
    net::HttpOptions http;
    http.port = static_cast<std::uint16_t>(port);
    http.pages = std::move(pages_);
    http_.emplace(loop_.io(), server_, std::move(http), served_viewer(), log_);
    at_end_.push_back([this] { http_->stop(); });
  }

  void add_igtl() {
    auto igtl = igtl_options(scene(), options_);
    if (!igtl) return;
    if (loaded_.plan)
      for (const PlannedSeed& seed : loaded_.plan->seeds(scene().template_grid))
        igtl->targets.push_back(seed.position);
    igtl_.emplace(loop_.io(), *igtl, server_, simulator().tissue(), log_);
    igtl_->set_scanner(console_->message());
    at_end_.push_back([this] {
      tracking_->cancel();
      igtl_->stop(why_it_ends());
    });
  }

  net::ServerOptions own_server_options() {
    net::ServerOptions o = server_options(scene(), options_, devices_.size());
    o.clock = &loop_.clock();
    if (handshakes_)
      o.handshake_thread = [this](std::function<void()> step) { handshakes_->post(std::move(step)); };
    return o;
  }

  net::ServerHandlers server_handlers() {
    net::ServerHandlers h;
    h.log = log_;
    h.state = [this] { return telemetry_->state(); };
    h.on_device = [this](bool attached, const net::DeviceInfo& device) { on_device(attached, device); };
    h.negotiated = [this](std::uint16_t needle) { return std::optional(forces_->link().negotiated(needle)); };
    h.on_stray_pose = [this](std::uint16_t needle, const std::string& device, net::StrayPose why) {
      notices_.add(needle, device, fault_of(why));
    };
    h.on_pose = [this](std::uint16_t needle, const NeedlePose& pose) { return on_pose(needle, pose); };
    return h;
  }

  void begin_session() {
    SessionManifest manifest = make_manifest(scene(), options_.config);
    manifest.trainee = options_.trainee;
    if (const Exercise* exercise = exercises_->running())
      manifest.exercise = ManifestText{exercises_->running_file().string(), exercise->text};
    loaded_.session->begin(std::move(manifest), loop_.clock().utc_ns());
    if (recorder_) recorder_->begin(loaded_.session->folder(), loaded_.session->start_s());
  }

  // --- the end ---

  /// Ends whatever the event loop waits for, so that run() returns. On the io thread.
  void end() {
    is_ending_ = true;
    end_signals_.cancel();
    duration_->cancel();
    std::for_each(at_end_.rbegin(), at_end_.rend(), [](const auto& stop) { stop(); });
  }

  /// For clients.
  std::string why_it_ends() const {
    return next_ ? goes_on_with_ + ": connect again" : std::string(net::kServerStops);
  }

  /// After all threads have ended.
  void finish(DaemonSummary& summary) {
    if (publisher_) summary.broker = publisher_->statistics();
    summary.loop = telemetry_->loop();
    summary.control = telemetry_->control();
    summary.ultrasound = telemetry_->ultrasound();
    summary.simd = to_string(simulator().simd_target());
    summary.evaluations = simulator().evaluation_counts();
    for (const auto& device : devices_) {
      summary.poses_accepted += device->network().guard().count(PoseStatus::kAccepted);
      summary.poses_refused += device->network().guard().refused();
    }
    summary.interventions = forces_->link().interventions();
    summary.forces_replaced = server_.forces_replaced();
    summary.wrong_tokens = server_.gate().wrong_tokens();
    take_last_state();
    summary.seeds_dropped = events_.seeds_dropped();
    summary.drops_refused = events_.drops_refused();
    safety_.end();
    notices_.end();
    network_log_.end();
    if (loaded_.session)
      summary.session = loaded_.session->end(exercises_->running(), loop_.clock().utc_ns());
  }

  // --- on the io thread ---

  std::string load(const net::LoadMessage& message, const std::string& client) {
    const bool is_nothing = message.plan_needle == net::LoadMessage::kNothing;
    if (!is_nothing && !changes_->has_plan()) return changes_->no_plan();
    const PlanNeedle* planned = is_nothing ? nullptr : changes_->needle(message.plan_needle);
    if (!is_nothing && !planned) return changes_->no_needle(message.plan_needle);
    if (is_probe(message.needle)) return "the probe carries no seeds";
    network_device(message.needle).load(is_nothing ? -1 : message.plan_needle);
    const std::string what = planned ? "as " + planned->hole : "as nothing";
    announce({net::EventKind::kNote, message.needle, 0, "needle loaded " + what + " by " + client});
    return {};
  }

  /// Ends this run for an attempt at an exercise, once its operator has been answered.
  std::string go_on_with(const net::ExerciseMessage& message, const std::string& client) {
    try {
      next_ = exercises_->attempt(message.file, message.trainee);
    } catch (const UserError& e) {
      return e.what();
    }
    goes_on_with_ = "exercise " + message.file + " begins";
    if (!message.trainee.empty()) goes_on_with_ += " for " + message.trainee;
    log_(goes_on_with_ + ", asked for by " + client);
    loop_.post([this] { end(); });
    return {};
  }

  void on_device(bool attached, const net::DeviceInfo& device) {
    NetworkDevice& needle = network_device(device.needle);
    if (!attached) {
      notices_.add_all(device.needle, text_of(device), needle.guard().faults_in_doubt());
      notices_.forget(text_of(device));
    }
    attached ? needle.attach() : needle.detach();
    if (is_ending_) return;  // the daemon disconnects it: no fault of the device
    if (is_probe(device.needle)) console_->on_probe_device(attached);
    if (!device.takes_force) return;
    forces_->on_device(attached, device);
    if (attached) log_(negotiated_line(device, forces_->link().negotiated(device.needle)));
  }

  net::PoseVerdict on_pose(std::uint16_t needle, const NeedlePose& pose) {
    const PoseStatus status = network_device(needle).submit(pose);
    if (const std::uint32_t faults = network_device(needle).guard().faults())
      notices_.add_all(needle, server_.lease_holder(needle), faults);
    const bool takes_force = forces_->link().gate(needle).connected();
    if (status == PoseStatus::kAccepted) {
      if (takes_force) forces_->link().pose_accepted(needle, pose);
      return {};
    }
    if (status == PoseStatus::kNotFinite && takes_force) forces_->link().pose_not_finite(needle);
    return {false, static_cast<std::uint16_t>(status), std::string(to_string(status))};
  }

  void on_tick(const TickForces& tick) {
    watch_->on_tick(tick.start_ns);
    if (!igtl_ || !igtl_->wants_ticks()) return;
    net::igtl::TrackedTick tracked{tick.run, tick.sim_time_s, tick.start_ns, {}};
    for (const NeedleTick& needle : tick.needles)
      tracked.X_WN.push_back(needle.is_present ? std::optional(needle.X_WN) : std::nullopt);
    net::TimerClock& clock = loop_.clock();
    igtl_->track(std::move(tracked), clock.utc_ns() - (clock.now_ns() - tick.start_ns));
  }
  /// Looks for ticks twice a period while a client of OpenIGTLink wants them.
  void follow_ticks() {
    if (igtl_->wants_ticks()) forces_->update();
    const double wait_s = igtl_->wants_ticks() ? scene().period_s() / 2 : 0.05;
    tracking_->start(std::chrono::nanoseconds(std::llround(1e9 * wait_s)), [this] { follow_ticks(); });
  }
  IgtlFigures igtl_figures() const {
    if (!igtl_) return {};
    const auto lost = igtl_->losses();
    return {igtl_->client_count(), igtl_->messages_dropped() + igtl_->other_names() + lost.skipped +
                                       lost.ignored + lost.replaced + lost.missed};
  }

  net::ImageDemand image_demand() const {
    net::ImageDemand demand = server_.image_demand();
    if (!igtl_) return demand;
    if (igtl_->wants_images()) demand.any = demand.plain = true;
    demand.joined += igtl_->images_asked();
    return demand;
  }
  void publish_model(std::uint64_t run, const std::shared_ptr<const SimulationModel>& model) {
    for (auto* models : {&hand_overs_.models, &hand_overs_.dosed_models}) {
      models->writer.slot() = {run, model};
      models->writer.publish();
    }
  }
  void deliver_images() {
    for (auto& images : hand_overs_.images) {
      if (!images.reader.update()) continue;
      const ScannedImage& image = images.reader.value();
      const auto body = [](const net::ImageMessage& m) {
        return m.data.empty() ? nullptr : net::encoded_body(m);
      };
      server_.publish_image(image.plain.array, body(image.plain), body(image.packed));
      if (igtl_ && igtl_->wants_images() && !image.plain.data.empty())
        igtl_->publish_image(std::make_shared<const net::ImageMessage>(image.plain));
    }
  }
  UltrasoundPorts ultrasound_ports() {
    return {hand_overs_.imaged_ticks.reader,
            hand_overs_.models.reader,
            console_->reader(),
            {&hand_overs_.images[0].writer, &hand_overs_.images[1].writer},
            hand_overs_.ultrasound.writer,
            [this](std::shared_ptr<const FrozenGland> gland) {
              loop_.post([this, gland = std::move(gland)] { studies_->keep(gland); });
            },
            [this] { loop_.post([this] { deliver_images(); }); },
            [this](const std::string& why) {
              loop_.post([this, why] { network_log_.info("no ultrasound images: " + why); });
            }};
  }

  // --- on the snapshot thread; a seed is in the session's ledger before any client receives it ---

  void deliver(std::shared_ptr<const MeshState> state) {
    if (loaded_.session) record(*state);
    if (changes_->for_events().update()) events_.set_planned(changes_->for_events().value().seeds);
    loop_.post([this, state] {
      safety_.update();
      notices_.update();
      spdlog::default_logger_raw()->flush();  // what waits for the log's reader
      for (const auto& take : on_snapshot_) take(state);
    });
    for (net::EventMessage& event : events_.update(*state)) announce(std::move(event));
    if (igtl_) igtl_->publish(state);
    server_.publish(std::move(state));
  }
  void record(const MeshState& state) {
    const bool is_saved = hand_overs_.saves->reader.update();
    if (auto failure =
            loaded_.session->record(state, is_saved ? &hand_overs_.saves->reader.value() : nullptr))
      announce({net::EventKind::kWarning, 0, state.summary.tick, std::move(*failure)});
  }
  /// Ticks after the last snapshot, whose thread has ended.
  void take_last_state() {
    if (!hand_overs_.states.reader.update()) return;
    if (loaded_.session) record(hand_overs_.states.reader.value());
    events_.update(hand_overs_.states.reader.value());
  }
  void announce(net::EventMessage event) {
    loop_.post([this, event = std::move(event)] { server_.broadcast(event); });
  }

  // --- on the dose thread ---

  void deliver_dose(net::DoseMessage message) {
    if (loaded_.session) loaded_.session->sync();
    loop_.post([this, message = std::move(message)] { server_.publish(message); });
  }

  const DaemonOptions options_;
  const std::optional<net::BrokerOptions> broker_;  // nullopt: nothing is published
  const LoadedScene loaded_;
  EventLoop loop_;
  Worker worker_;                                         // builds simulators
  SimulationRuns runs_;                                   // io thread; its reader the deformation thread
  std::vector<std::unique_ptr<SwitchedDevice>> devices_;  // by needle
  const RigidTransform X_WR_;                             // the probe at rest
  HandOvers hand_overs_;
  TickEvents events_;  // snapshot thread

  // On the io thread.
  std::vector<std::function<void(const std::shared_ptr<const MeshState>&)>> on_snapshot_;  // in this order
  std::vector<std::function<void()>> at_end_;         // the last one first
  net::DynamicPages pages_;                           // until http_ has them
  SignalWait end_signals_{loop_, {SIGINT, SIGTERM}};  // from construction on: a signal before run() is kept
  const std::unique_ptr<net::Timer> duration_ = loop_.make_timer();
  const std::unique_ptr<net::Timer> tracking_ = loop_.make_timer();  // of follow_ticks()
  NetworkLog network_log_{loop_.clock()};
  const std::function<void(const std::string&)> log_ = [this](const std::string& line) {
    network_log_.info(line);
  };
  SafetyNotices safety_{loop_.clock(), [this](const net::EventMessage& event) {
                          network_log_.safety("safety: " + event.text);
                          server_.broadcast(event);
                        }};
  PoseNotices notices_{loop_.clock(), [this](const net::EventMessage& event) {
                         network_log_.info(event.text);
                         server_.broadcast(event);
                       }};
  bool is_ending_ = false;
  std::optional<Attempt> next_;               // why it is ending; none: for good
  std::string goes_on_with_;                  // what clients are told then
  const std::unique_ptr<Worker> handshakes_;  // computes what server_ gives it; null: no TLS
  net::Server server_;
  // Made by wire(), as are all below.
  std::optional<ForceCycle> forces_;
  std::optional<net::HttpListener> http_;      // its sessions are server_'s; nullopt: off
  std::optional<net::igtl::IgtlServer> igtl_;  // nullopt: off
  std::optional<net::Publisher> publisher_;    // nullopt: off; its run() has a thread of its own
  std::optional<Controls> controls_;
  std::optional<PlanChanges> changes_;     // its readers the deformation, dose and snapshot threads
  std::optional<ScannerConsole> console_;  // its reader the ultrasound thread
  std::optional<VolumeStudies> studies_;   // nullopt: no ultrasound
  std::optional<ServiceWatch> watch_;
  std::optional<SceneReload> reload_;
  std::optional<Telemetry> telemetry_;
  std::optional<ExercisePages> exercises_;   // computes scores on a thread of its own
  std::optional<SessionPages> teacher_;      // reads sessions on a thread of its own; nullopt: no --sessions
  std::optional<SessionRecorder> recorder_;  // writes on a thread of its own; nullopt: the same
};

Daemon::Daemon(const Scene& scene, const DaemonOptions& options, net::TimerClock& clock)
    : impl_(std::make_unique<Impl>(scene, options, clock)) {}
Daemon::~Daemon() = default;
std::uint16_t Daemon::port() const {
  return impl_->server_.port();
}
std::optional<std::uint16_t> Daemon::igtl_port() const {
  const auto& igtl = impl_->igtl_;
  return igtl && !igtl->address().empty() ? std::optional(igtl->port()) : std::nullopt;
}
const std::string& Daemon::igtl_address() const {
  return impl_->igtl_.value().address();
}
const std::string& Daemon::address() const {
  return impl_->server_.address();
}
std::optional<std::uint16_t> Daemon::http_port() const {
  return impl_->http_ ? std::optional(impl_->http_->port()) : std::nullopt;
}
DaemonSummary Daemon::run() {
  return impl_->run();
}
void Daemon::stop() {
  impl_->stop();
}

}  // namespace brachy
