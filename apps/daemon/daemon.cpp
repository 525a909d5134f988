#include "apps/daemon/daemon.h"

#include <fmt/format.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

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
#include "apps/daemon/forces/force_cycle.h"
#include "apps/daemon/forces/safety_notices.h"
#include "apps/daemon/io/event_loop.h"
#include "apps/daemon/loops/deformation_loop.h"
#include "apps/daemon/loops/simulation_runs.h"
#include "apps/daemon/loops/snapshot_loop.h"
#include "apps/daemon/loops/ultrasound_loop.h"
#include "apps/daemon/network_log.h"
#include "apps/daemon/recorded_session.h"
#include "apps/daemon/scene_message.h"
#include "apps/daemon/service/service_watch.h"
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
                                              const std::optional<Plan>& plan,
                                              const std::vector<Structure>& structures) {
  if (!options.session) return nullptr;
  return std::make_unique<RecordedSession>(*options.session, scene, plan,
                                           names_of(tested_organs(structures)));
}

/// Null: nothing is recorded.
std::function<Score()> score_of(const RecordedSession* session) {
  if (!session) return nullptr;
  return [session] { return session->score(); };
}

/// Null: nothing is recorded.
VolumeStudies::Store store_of(const RecordedSession* session) {
  if (!session) return nullptr;
  return [session](RecordedStudy study) { return session->store(std::move(study)); };
}

MeshState start_state(Simulator& simulator, const RecordedSession* session,
                      const std::optional<PlanLedger>& ledger) {
  if (ledger) simulator.set_plan(ledger->loading());
  if (session) {
    simulator.restore_seeds(session->restored());
    simulator.restore_lost(session->restored_lost());
  }
  return simulator.initial_state();
}

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

/// The thread of TLS handshakes, which anybody can cause.
std::unique_ptr<Worker> make_handshake_thread() {
  auto thread = std::make_unique<Worker>();
  thread->post(as_background_thread("handshake"));
  return thread;
}

}  // namespace

class Daemon::Impl {
 public:
  Impl(const Scene& scene, const DaemonOptions& options, net::TimerClock& clock)
      : scene_(scene),
        options_(options),
        broker_(broker_options(scene, options)),
        plan_(load_plan(scene)),
        structures_(load_structures(scene)),
        // A volume that cannot be used is told at once; what is made up waits for a client that asks for images.
        echoes_(scene.ultrasound.on && !scene.ultrasound.volume.empty() ? load_echo_map(scene, structures_)
                                                                        : nullptr),
        session_(open_session(scene, options, plan_, structures_)),
        loop_(clock),
        runs_(std::make_shared<SimulationRun>(
                  0, false, load_simulation_model(scene, load_simulated_tissue(scene), options.set_up)),
              loop_, worker_),
        ledger_(plan_ledger(scene, plan_, options.session)),
        states_(start_state(simulator(), session_.get(), ledger_)),
        seeds_(DroppedSeeds(simulator().initial_state())),
        needle_count_(scene.instrument_count()),
        devices_(make_devices(scene, simulator().tissue(), needle_count_)),
        tick_forces_(TickForces(needle_count_)),
        imaged_ticks_(ImagedTick(simulator(), simulator().initial_state())),
        events_(simulator().initial_state(),
                ledger_ ? ledger_->all().seeds(scene.template_grid) : std::vector<PlannedSeed>(),
                names_of(simulator().model()->organs)),
        forces_(loop_, tick_forces_.reader, needle_count_, force_outputs(),
                [this](const TickForces& tick) { on_tick(tick); }),
        handshakes_(scene.server.has_tls() ? make_handshake_thread() : nullptr),
        server_(loop_.io(), own_server_options(), simulator().tissue(), handlers()),
        controls_(scene, devices_, runs_, server_, log_, session_ != nullptr),
        changes_(scene_, structures_, ledger_, session_ ? options.session : std::nullopt,
                 session_ ? session_->start_s() : 0,
                 session_ ? session_->restored_lost() : std::vector<std::int32_t>(), loop_, runs_, server_,
                 as_background_thread("plan"), log_),
        X_WR_(resting_probe(scene, simulator().tissue())),
        console_(scene, scene.probe.on ? add_stepper() : nullptr,
                 [this](const net::ScannerMessage& message) { server_.publish(message); }),
        studies_(loop_, worker_, structures_.front().mesh, scene.period_s(), store_of(session_.get()),
                 [this](const std::string& text) {
                   log_(text);
                   server_.broadcast({net::EventKind::kWarning, 0, 0, text});
                 }),
        watch_(loop_, scene.period_s(),
               {[this] { forces_.update(); }, [this] { return telemetry_.status(); }}),
        reload_(loop_, worker_, controls_, watch_, options),
        telemetry_(loop_, {loop_statistics_.reader, control_statistics_.reader, server_, runs_,
                           std::as_const(forces_).link(), controls_, reload_, watch_,
                           [this] { return igtl_figures(); }, ultrasound_statistics_.reader}),
        exercises_(loop_, options.config, score_of(session_.get()), as_background_thread("score")) {
    spdlog::info("engine: {}, {} thread{}", to_string(simulator().simd_target()), scene.engine.threads,
                 scene.engine.threads == 1 ? "" : "s");
    runs_.on_model = [this](std::uint64_t run, const auto& model) { publish_model(run, model); };
    publish_model(0, simulator().model());
    server_.set_scene(make_scene_message(scene, plan_, structures_));
    if (scene.device.kind == "scripted" || options.play)
      if (const std::string refusal = controls_.play(scene.device.loop || options.play); !refusal.empty())
        throw UserError(refusal);
    if (const int port = options.http_port.value_or(scene.server.http_port); port >= 0) {
      net::HttpOptions http;
      http.port = static_cast<std::uint16_t>(port);
      http.pages = telemetry_.pages();
      http.pages.merge(exercises_.pages());
      http.pages["/volume"] = volume_page(scene);
      http_.emplace(loop_.io(), server_, std::move(http), served_viewer(), log_);
    }
    if (broker_) publisher_.emplace(loop_.io(), server_, *broker_, log_);
    if (auto igtl = igtl_options(scene, options)) {
      if (plan_)
        for (const PlannedSeed& seed : plan_->seeds(scene.template_grid))
          igtl->targets.push_back(seed.position);
      if (scene.server.igtl_commands) igtl->commands = igtl_commands();
      igtl_.emplace(loop_.io(), *igtl, server_, simulator().tissue(), log_);
    }
  }

  ~Impl() {
    worker_.end();  // what it builds refers to members that are destroyed next
  }

  const net::Server& server() const { return server_; }
  std::optional<std::uint16_t> http_port() const {
    return http_ ? std::optional(http_->port()) : std::nullopt;
  }
  std::optional<std::uint16_t> igtl_port() const {
    return igtl_ && !igtl_->address().empty() ? std::optional(igtl_->port()) : std::nullopt;
  }
  const std::string& igtl_address() const { return igtl_.value().address(); }

  DaemonSummary run() {
    end_signals_.start([this](int number) {
      spdlog::info("signal {}: ending", number);
      end();
    });
    if (options_.duration_s)
      duration_->start(std::chrono::nanoseconds(std::llround(*options_.duration_s * 1e9)), [this] { end(); });
    if (igtl_) follow_ticks();
    if (options_.report_every_s) telemetry_.start_reports(*options_.report_every_s, options_.json);

    DaemonSummary summary;
    const std::int64_t start_ns = loop_.clock().now_ns();
    std::vector<Vec3> surface = surface_vertices(simulator().tissue());
    std::promise<std::string> granted;
    std::jthread deformation([&](const std::stop_token& stop) {
      name_thread("deformation");
      const RealtimeGrant grant =
          request_realtime({scene_.realtime.fifo_priority, scene_.realtime.lock_memory});
      drop_capabilities();
      granted.set_value(to_string(grant));
      std::vector<Device*> devices;
      for (const auto& device : devices_) devices.push_back(device.get());
      run_deformation_loop(stop, loop_.clock(), runs_.in_use(),
                           {runs_.reader(), devices, states_.writer, tick_forces_.writer, seeds_.writer,
                            loop_statistics_.writer, &changes_.for_simulator(),
                            has_ultrasound() ? &imaged_ticks_.writer : nullptr});
    });
    std::jthread control;
    if (options_.control_thread || scene_.realtime.control_thread)
      control = std::jthread([&](const std::stop_token& stop) {
        name_thread("control");
        request_realtime(
            {scene_.realtime.fifo_priority, false});  // the same scheduling as the deformation thread
        drop_capabilities();
        run_control_loop(stop, loop_.clock(), scene_.period_s(), control_statistics_.writer);
      });
    // Only those two threads need capabilities. Threads that this one creates from here on inherit none.
    drop_capabilities();
    worker_.post([] {
      name_thread("worker");
      drop_capabilities();
    });
    std::jthread snapshots([&](const std::stop_token& stop) {
      name_thread("snapshot");
      summary.snapshots = run_snapshot_loop(stop, loop_.clock(), scene_.rates.snapshot_hz, states_.reader,
                                            [&](auto state) { deliver(std::move(state)); });
    });
    std::jthread dose([&](const std::stop_token& stop) {
      name_thread("dose");
      summary.dose =
          run_dose_loop(stop, loop_.clock(), structures_, dose_settings(), std::move(surface), plan_to_come(),
                        seeds_.reader, [&](net::DoseMessage message) { deliver_dose(std::move(message)); });
    });
    std::jthread ultrasound;
    if (has_ultrasound())
      ultrasound = std::jthread([&](const std::stop_token& stop) {
        name_thread("ultrasound");
        stand_back();
        run_ultrasound_loop(stop, loop_.clock(), scene_, structures_, echoes_, X_WR_, ultrasound_ports());
      });
    std::jthread broker;
    if (publisher_)
      broker = std::jthread([&](const std::stop_token& stop) {
        const std::stop_callback stop_publisher(stop, [&] { publisher_->stop(); });
        publisher_->run();
      });
    summary.realtime = granted.get_future().get();
    if (scene_.realtime.fifo_priority || scene_.realtime.lock_memory) spdlog::info("{}", summary.realtime);
    watch_.begin();

    loop_.run();
    worker_.stop();  // a simulator that it still builds, which may take seconds, is not needed any more
    exercises_.stop();
    changes_.stop();
    summary.is_worker_busy =
        runs_.is_building() || reload_.is_running() || exercises_.is_scoring() || changes_.is_optimising();

    // The deformation thread first: its last tick is then in the last snapshot.
    for (std::jthread* thread : {&deformation, &snapshots, &dose, &ultrasound, &control, &broker}) {
      thread->request_stop();
      if (thread->joinable()) thread->join();
    }
    summary.elapsed_s = 1e-9 * static_cast<double>(loop_.clock().now_ns() - start_ns);
    finish(summary);
    return summary;
  }

  void stop() {
    loop_.post([this] { end(); });
  }

 private:
  Simulator& simulator() { return runs_.in_use().simulator; }
  bool has_ultrasound() const { return scene_.ultrasound.on; }
  NetworkDevice& network_device(std::size_t needle) { return devices_[needle]->network(); }

  /// Ends whatever the event loop waits for, so that run() returns. On the io thread.
  void end() {
    is_ending_ = true;
    end_signals_.cancel();
    duration_->cancel();
    watch_.end();
    reload_.stop();
    forces_.stop();
    tracking_->cancel();
    telemetry_.stop_reports();
    if (igtl_) igtl_->stop();
    server_.stop();
    if (http_) http_->stop();
  }

  /// After all threads have ended.
  void finish(DaemonSummary& summary) {
    if (publisher_) summary.broker = publisher_->statistics();
    summary.loop = telemetry_.loop();
    summary.control = telemetry_.control();
    summary.ultrasound = telemetry_.ultrasound();
    summary.simd = to_string(simulator().simd_target());
    summary.evaluations = simulator().evaluation_counts();
    for (const auto& device : devices_) {
      summary.poses_accepted += device->network().guard().count(PoseStatus::kAccepted);
      summary.poses_refused += device->network().guard().refused();
    }
    summary.interventions = forces_.link().interventions();
    summary.forces_replaced = server_.forces_replaced();
    summary.wrong_tokens = server_.gate().wrong_tokens();
    take_last_state();
    summary.seeds_dropped = events_.seeds_dropped();
    summary.drops_refused = events_.drops_refused();
    safety_.end();
    network_log_.end();
    if (session_) summary.session = session_->end(exercises_.running());
  }

  net::ServerOptions own_server_options() {
    net::ServerOptions o = server_options(scene_, options_, needle_count_);
    o.clock = &loop_.clock();
    if (handshakes_)
      o.handshake_thread = [this](std::function<void()> step) { handshakes_->post(std::move(step)); };
    return o;
  }

  // On the io thread.
  net::ServerHandlers handlers() {
    net::ServerHandlers h;
    h.log = log_;
    h.state = [this] { return telemetry_.state(); };
    h.on_device = [this](bool attached, const net::DeviceInfo& device) { on_device(attached, device); };
    h.negotiated = [this](std::uint16_t needle) -> std::optional<net::NegotiatedLimits> {
      return forces_.link().negotiated(needle);
    };
    h.on_pose = [this](std::uint16_t needle, const NeedlePose& pose) { return on_pose(needle, pose); };
    h.on_drop = [this](std::uint16_t needle, bool pressed) { network_device(needle).press(pressed); };
    h.on_control = [this](const net::ControlMessage& message, const std::string& client) {
      return is_ending_ ? "the daemon is ending" : controls_.execute(message, client);
    };
    h.on_load = [this](const net::LoadMessage& message, const std::string& client) {
      return is_ending_ ? "the daemon is ending" : load(message, client);
    };
    h.on_plan = [this](const net::PlanMessage& message, const std::string& client) {
      return is_ending_ ? "the daemon is ending" : changes_.execute(message, client);
    };
    if (has_ultrasound()) {
      h.on_scanner = [this](const net::ScannerMessage& message, const std::string&) {
        return console_.execute(message);
      };
      h.on_contour = [this](const net::ContourMessage& message, const std::string&, auto answer) {
        return is_ending_ ? "the daemon is ending" : studies_.execute(message, std::move(answer));
      };
    }
    h.on_arm = [this](std::uint16_t needle, const std::string& client) {
      forces_.link().arm(needle, client);
    };
    return h;
  }

  std::string load(const net::LoadMessage& message, const std::string& client) {
    const bool is_nothing = message.plan_needle == net::LoadMessage::kNothing;
    if (!is_nothing && !changes_.has_plan()) return "there is no plan to load a needle from";
    const PlanNeedle* planned = is_nothing ? nullptr : changes_.needle(message.plan_needle);
    if (!is_nothing && !planned) return changes_.no_needle(message.plan_needle);
    if (scene_.probe.on && message.needle == scene_.needle.count) return "the probe carries no seeds";
    network_device(message.needle).load(is_nothing ? -1 : message.plan_needle);
    const std::string what = planned ? "as " + planned->hole : "as nothing";
    announce({net::EventKind::kNote, message.needle, 0, "needle loaded " + what + " by " + client});
    return {};
  }

  void on_device(bool attached, const net::DeviceInfo& device) {
    NetworkDevice& needle = network_device(device.needle);
    attached ? needle.attach() : needle.detach();
    if (is_ending_) return;  // the daemon disconnects it: no fault of the device
    if (scene_.probe.on && device.needle == scene_.needle.count) console_.on_probe_device(attached);
    if (!device.takes_force) return;
    forces_.on_device(attached, device);
    if (attached) log_(negotiated_line(device, forces_.link().negotiated(device.needle)));
  }

  net::PoseVerdict on_pose(std::uint16_t needle, const NeedlePose& pose) {
    const PoseStatus status = network_device(needle).submit(pose);
    const bool takes_force = forces_.link().gate(needle).connected();
    if (status == PoseStatus::kAccepted) {
      if (takes_force) forces_.link().pose_accepted(needle, pose);
      return {};
    }
    if (status == PoseStatus::kNotFinite && takes_force) forces_.link().pose_not_finite(needle);
    return {false, static_cast<std::uint16_t>(status), std::string(to_string(status))};
  }

  /// On the io thread.
  void on_tick(const TickForces& tick) {
    watch_.on_tick(tick.start_ns);
    if (!igtl_ || !igtl_->wants_ticks()) return;
    net::igtl::TrackedTick tracked{tick.run, tick.sim_time_s, tick.start_ns, {}};
    for (const NeedleTick& needle : tick.needles)
      tracked.X_WN.push_back(needle.is_present ? std::optional(needle.X_WN) : std::nullopt);
    net::TimerClock& clock = loop_.clock();
    igtl_->track(std::move(tracked), clock.utc_ns() - (clock.now_ns() - tick.start_ns));
  }
  /// Looks for ticks twice a period while a client of OpenIGTLink wants them.
  void follow_ticks() {
    if (igtl_->wants_ticks()) forces_.update();
    const double wait_s = igtl_->wants_ticks() ? scene_.period_s() / 2 : 0.05;
    tracking_->start(std::chrono::nanoseconds(std::llround(1e9 * wait_s)), [this] { follow_ticks(); });
  }
  IgtlFigures igtl_figures() const {
    if (!igtl_) return {};
    const auto lost = igtl_->losses();
    return {igtl_->client_count(), igtl_->messages_dropped() + igtl_->other_names() + lost.skipped +
                                       lost.ignored + lost.replaced + lost.missed};
  }
  net::igtl::CommandHandlers igtl_commands() {
    net::ServerHandlers native = handlers();
    return {native.on_control, native.on_arm, native.on_drop};
  }

  ForceLinkOutputs force_outputs() {
    ForceLinkOutputs o;
    o.send_force = [this](const net::ForceMessage& message) { server_.send(message.needle, message); };
    o.send_model = [this](const net::LocalModelMessage& message) { server_.send(message.needle, message); };
    o.round_trip_s = [this](std::uint16_t needle) { return server_.round_trip_s(needle); };
    o.announce = [this](const net::EventMessage& event) { safety_.add(event); };
    return o;
  }

  // On the snapshot thread. A seed is in the session's ledger before any client receives it.
  void deliver(std::shared_ptr<const MeshState> state) {
    if (session_) record(*state);
    if (changes_.for_events().update()) events_.set_planned(changes_.for_events().value().seeds);
    loop_.post(
        [this, run = state->summary.run, tick = state->summary.tick, seeds = state->seeds.count, state] {
          safety_.update();
          spdlog::default_logger_raw()->flush();  // what waits for the log's reader
          telemetry_.set_seed_count(seeds);
          controls_.on_snapshot(run);
          changes_.on_snapshot(state);
          if (has_ultrasound()) console_.update(image_demand(), tick);
          reload_.begin_if_requested();
        });
    for (net::EventMessage& event : events_.update(*state)) announce(std::move(event));
    if (igtl_) igtl_->publish(state);
    server_.publish(std::move(state));
  }
  void record(const MeshState& state) {
    if (auto failure = session_->record(state))
      announce({net::EventKind::kWarning, 0, state.summary.tick, std::move(*failure)});
  }
  /// Ticks after the last snapshot, whose thread has ended.
  void take_last_state() {
    if (!states_.reader.update()) return;
    if (session_) record(states_.reader.value());
    events_.update(states_.reader.value());
  }
  void announce(net::EventMessage event) {
    loop_.post([this, event = std::move(event)] { server_.broadcast(event); });
  }

  // On the io thread.
  SwitchedDevice* add_stepper() {
    devices_.back()->add_stepper(X_WR_);
    return devices_.back().get();
  }
  net::ImageDemand image_demand() const {
    net::ImageDemand demand = server_.image_demand();
    if (igtl_ && igtl_->wants_images()) demand.any = demand.plain = true;
    return demand;
  }
  void publish_model(std::uint64_t run, const std::shared_ptr<const SimulationModel>& model) {
    scanned_models_.writer.slot() = {run, model};
    scanned_models_.writer.publish();
  }
  void deliver_images() {
    for (auto& images : images_) {
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
    return {imaged_ticks_.reader,
            scanned_models_.reader,
            console_.reader(),
            {&images_[0].writer, &images_[1].writer},
            ultrasound_statistics_.writer,
            [this](std::shared_ptr<const FrozenGland> gland) {
              loop_.post([this, gland = std::move(gland)] { studies_.keep(gland); });
            },
            [this] { loop_.post([this] { deliver_images(); }); },
            [this](const std::string& why) {
              loop_.post([this, why] { network_log_.info("no ultrasound images: " + why); });
            }};
  }

  // On the dose thread.
  DoseSettings dose_settings() const {
    DoseSettings settings = scene_.dose;
    if (plan_) settings.prescription_gy = plan_->prescription_gy;
    return settings;
  }
  PlanToCome plan_to_come() {
    return {changes_.for_dose(), session_ ? session_->restored_lost() : std::vector<std::int32_t>()};
  }
  void deliver_dose(net::DoseMessage message) {
    if (session_) session_->sync();
    loop_.post([this, message = std::move(message)] { server_.publish(message); });
  }

  Scene scene_;
  DaemonOptions options_;
  std::optional<net::BrokerOptions> broker_;  // nullopt: nothing is published
  std::optional<Plan> plan_;
  std::vector<Structure> structures_;
  std::shared_ptr<const EchoMap> echoes_;     // null: made at the first demand
  std::unique_ptr<RecordedSession> session_;  // snapshot thread; its sync() the dose thread; null: none
  EventLoop loop_;
  Worker worker_;        // builds simulators
  SimulationRuns runs_;  // io thread; its reader the deformation thread

  const std::optional<PlanLedger> ledger_;  // at the start; none: there is no plan

  // From the deformation thread, except the last, which is from the control thread.
  HandOver<MeshState> states_;    // to the snapshot thread
  HandOver<DroppedSeeds> seeds_;  // to the dose thread
  std::size_t needle_count_;
  std::vector<std::unique_ptr<SwitchedDevice>> devices_;  // by needle
  HandOver<TickForces> tick_forces_;                      // to the io thread, as the next two
  HandOver<LoopStatistics> loop_statistics_;
  HandOver<LoopStatistics> control_statistics_;
  HandOver<ImagedTick> imaged_ticks_;                                         // to the ultrasound thread
  HandOver<ScannedModel> scanned_models_;                                     // to it, from the io thread
  std::array<HandOver<ScannedImage>, UltrasoundScanner::kMostViews> images_;  // from it, to the io thread
  HandOver<UltrasoundStatistics> ultrasound_statistics_;                      // likewise
  TickEvents events_;                                                         // snapshot thread

  // On the io thread.
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
  ForceCycle forces_;
  bool is_ending_ = false;
  std::unique_ptr<Worker> handshakes_;  // computes what server_ gives it; null: no TLS
  net::Server server_;
  std::optional<net::HttpListener> http_;      // its sessions are server_'s
  std::optional<net::igtl::IgtlServer> igtl_;  // nullopt: off
  std::optional<net::Publisher> publisher_;    // nullopt: off; its run() has a thread of its own
  Controls controls_;
  PlanChanges changes_;        // its readers the deformation, dose and snapshot threads
  const RigidTransform X_WR_;  // the probe at rest
  ScannerConsole console_;     // its reader the ultrasound thread
  VolumeStudies studies_;
  ServiceWatch watch_;
  SceneReload reload_;
  Telemetry telemetry_;
  ExercisePages exercises_;  // computes scores on a thread of its own
};

Daemon::Daemon(const Scene& scene, const DaemonOptions& options, net::TimerClock& clock)
    : impl_(std::make_unique<Impl>(scene, options, clock)) {}
Daemon::~Daemon() = default;
std::uint16_t Daemon::port() const {
  return impl_->server().port();
}
std::optional<std::uint16_t> Daemon::igtl_port() const {
  return impl_->igtl_port();
}
const std::string& Daemon::igtl_address() const {
  return impl_->igtl_address();
}
const std::string& Daemon::address() const {
  return impl_->server().address();
}
std::optional<std::uint16_t> Daemon::http_port() const {
  return impl_->http_port();
}
DaemonSummary Daemon::run() {
  return impl_->run();
}
void Daemon::stop() {
  impl_->stop();
}

}  // namespace brachy
