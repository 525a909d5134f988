#include "apps/brachyd/daemon.h"

#include <fmt/format.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <future>
#include <iostream>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "apps/brachyd/controls.h"
#include "apps/brachyd/daemon_setup.h"
#include "apps/brachyd/deformation_loop.h"
#include "apps/brachyd/force_link.h"
#include "apps/brachyd/interval_report.h"
#include "apps/brachyd/network_log.h"
#include "apps/brachyd/recorded_session.h"
#include "apps/brachyd/scene_message.h"
#include "apps/brachyd/service/metrics_text.h"
#include "apps/brachyd/service/scene_reload.h"
#include "apps/brachyd/service/service_watch.h"
#include "apps/brachyd/simulation_runs.h"
#include "apps/brachyd/snapshot_loop.h"
#include "apps/brachyd/tick_events.h"
#include "core/plan/plan_file.h"
#include "core/realtime/capabilities.h"
#include "core/realtime/deadline.h"
#include "core/realtime/realtime_thread.h"
#include "core/structures/load_structures.h"
#include "haptics/switched_device.h"
#include "net/broker/publisher.h"
#include "net/http/http_listener.h"
#include "net/igtl/igtl_server.h"
#include "net/server.h"

namespace brachy {
namespace {

std::unique_ptr<RecordedSession> open_session(const Scene& scene, const DaemonOptions& options,
                                              const std::optional<Plan>& plan) {
  if (!options.session) return nullptr;
  return std::make_unique<RecordedSession>(*options.session, scene, plan);
}

MeshState start_state(Simulator& simulator, const RecordedSession* session) {
  if (session) simulator.restore_seeds(session->restored());
  return simulator.initial_state();
}

std::vector<Vec3> surface_vertices(const Tissue& tissue) {
  const auto first = tissue.rest_vertices.begin();
  return {first, first + static_cast<std::ptrdiff_t>(tissue.surface_count)};
}

/// As top -H and ps -L show it.
void name_thread(const char* name) {
  pthread_setname_np(pthread_self(), name);
}

double wall_clock_s() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since_1970).count();
}

net::Quantiles quantiles_ms(const Histogram& ns) {
  const auto ms = [&](double q) { return 1e-6 * static_cast<double>(ns.quantile(q)); };
  return {ns.count(), ms(0.5), ms(0.99), ms(0.999), 1e-6 * static_cast<double>(ns.max())};
}

}  // namespace

class Daemon::Impl {
 public:
  Impl(const Scene& scene, const DaemonOptions& options)
      : scene_(scene),
        options_(options),
        broker_(broker_options(scene, options)),
        plan_(load_plan(scene)),
        structures_(load_structures(scene)),
        session_(open_session(scene, options, plan_)),
        runs_(std::make_shared<SimulationRun>(0, false, scene, load_simulated_tissue(scene)), io_, workers_),
        states_(start_state(simulator(), session_.get())),
        fallen_(FallenSeeds(simulator().initial_state())),
        needle_count_(scene.needle.count),
        devices_(make_devices(scene, simulator().tissue(), needle_count_)),
        tick_forces_(TickForces(needle_count_)),
        events_(simulator().initial_state(),
                plan_ ? plan_->seeds(scene.template_grid) : std::vector<PlannedSeed>()),
        force_link_(needle_count_, force_outputs()),
        server_(io_, server_options(scene, options, needle_count_), simulator().tissue(), handlers()),
        controls_(scene, devices_, runs_, server_, log_, session_ != nullptr),
        watch_(io_, scene.period_s(), {[this] { take_tick(monotonic_ns()); }, [this] { return status(); }}),
        reload_(io_, workers_, controls_, watch_, options) {
    spdlog::info("engine: {}, {} thread{}", to_string(simulator().simd_target()), scene.engine.threads,
                 scene.engine.threads == 1 ? "" : "s");
    server_.show_scene(make_scene_message(scene, plan_, structures_));
    if (scene.device.kind == "scripted" || options.play)
      if (const std::string refusal = controls_.play(scene.device.loop || options.play); !refusal.empty())
        throw UserError(refusal);
    const int http_port = options.http_port.value_or(scene.server.http_port);
    if (http_port >= 0)
      http_.emplace(io_, server_, http_options(static_cast<std::uint16_t>(http_port)), served_viewer(), log_);
    if (broker_) publisher_.emplace(io_, server_, *broker_, log_);
    if (const auto igtl = igtl_options(scene, options))
      igtl_.emplace(io_, *igtl, server_, simulator().tissue(), log_);
  }

  ~Impl() {
    workers_.stop();
    workers_.join();  // what is being made there looks at what is destroyed next
  }

  const net::Server& server() const { return server_; }
  std::optional<std::uint16_t> http_port() const {
    return http_ ? std::optional(http_->port()) : std::nullopt;
  }
  std::optional<std::uint16_t> igtl_port() const {
    return igtl_ ? std::optional(igtl_->port()) : std::nullopt;
  }

  const std::string& igtl_address() const { return igtl_.value().address(); }

  DaemonSummary run() {
    boost::asio::steady_timer duration(io_);
    const auto end = [&] {
      signals_.cancel();
      duration.cancel();
      is_ending_ = true;
      watch_.end();
      reload_.stop();
      cycle_timer_.cancel();
      report_timer_.cancel();
      if (igtl_) igtl_->stop();
      server_.stop();
      if (http_) http_->stop();
    };
    end_ = end;
    signals_.async_wait([&](const auto& error, int number) {
      if (error) return;
      spdlog::info("signal {}: ending", number);
      end();
    });
    if (options_.duration_s) {
      duration.expires_after(std::chrono::nanoseconds(std::llround(*options_.duration_s * 1e9)));
      duration.async_wait([&](const auto& error) {
        if (!error) end();
      });
    }

    DaemonSummary summary;
    std::vector<Vec3> surface = surface_vertices(simulator().tissue());
    const std::int64_t start_ns = monotonic_ns();
    if (options_.report_every_s) report_next(start_ns);
    std::promise<std::string> granted;
    std::jthread deformation([&](const std::stop_token& stop) {
      name_thread("deformation");
      const RealtimeGrant grant =
          request_realtime({scene_.realtime.fifo_priority, scene_.realtime.lock_memory});
      drop_capabilities();
      granted.set_value(to_string(grant));
      std::vector<Device*> devices;
      for (const auto& device : devices_) devices.push_back(device.get());
      run_deformation_loop(stop, runs_.in_use(), runs_.reader(), devices, state_writer_, force_writer_,
                           fallen_writer_, loop_writer_);
    });
    std::jthread control;
    if (options_.control_thread || scene_.realtime.control_thread)
      control = std::jthread([&](const std::stop_token& stop) {
        name_thread("control");
        request_realtime({scene_.realtime.fifo_priority, false});  // woken on the same terms
        drop_capabilities();
        run_control_loop(stop, scene_.period_s(), control_writer_);
      });
    // Only those two ask the kernel for anything. What this thread creates from here on has its capabilities: none.
    drop_capabilities();
    boost::asio::post(workers_, [] {
      name_thread("worker");
      drop_capabilities();
    });
    std::jthread snapshots([&](const std::stop_token& stop) {
      name_thread("snapshot");
      summary.snapshots = run_snapshot_loop(stop, scene_.rates.snapshot_hz, state_reader_,
                                            [&](auto state) { deliver(std::move(state)); });
    });
    std::jthread dose([&](const std::stop_token& stop) {
      name_thread("dose");
      summary.dose = run_dose_loop(stop, structures_, dose_settings(), std::move(surface), fallen_reader_,
                                   [&](net::DoseMessage message) { deliver_dose(std::move(message)); });
    });
    std::jthread broker;
    if (publisher_)
      broker = std::jthread([&](const std::stop_token& stop) {
        const std::stop_callback end_too(stop, [&] { publisher_->stop(); });
        publisher_->run();
      });
    summary.realtime = granted.get_future().get();
    if (scene_.realtime.fifo_priority || scene_.realtime.lock_memory) spdlog::info("{}", summary.realtime);
    watch_.begin();

    io_.run();
    // What a worker still makes, nobody needs any more: it may take seconds.
    workers_.stop();
    summary.is_worker_busy = runs_.is_making() || reload_.is_running();

    // In this order: what the deformation did last is in the last snapshot.
    for (std::jthread* thread : {&deformation, &snapshots, &dose, &control, &broker}) {
      thread->request_stop();
      if (thread->joinable()) thread->join();
    }
    if (publisher_) summary.broker = publisher_->statistics();
    summary.elapsed_s = 1e-9 * static_cast<double>(monotonic_ns() - start_ns);
    loop_reader_.update();
    control_reader_.update();
    summary.loop = loop_reader_.value();
    summary.control = control_reader_.value();
    summary.simd = to_string(simulator().simd_target());
    summary.evaluations = simulator().evaluation_counts();  // its thread has ended
    for (const auto& device : devices_) {
      summary.poses_accepted += device->network().guard().count(PoseVerdict::kAccepted);
      summary.poses_refused += device->network().guard().refused();
    }
    summary.interventions = force_link_.interventions();
    summary.forces_replaced = server_.forces_replaced();
    summary.wrong_tokens = server_.gate().wrong_tokens();
    take_last_state();
    summary.seeds_dropped = events_.seeds_dropped();
    summary.drops_refused = events_.drops_refused();
    network_log_.end();
    if (session_) summary.session = session_->end();
    return summary;
  }

  void stop() {
    boost::asio::post(io_, [this] { end_(); });
  }

 private:
  Simulator& simulator() { return runs_.in_use().simulator; }
  NetworkDevice& network_device(std::size_t needle) { return devices_[needle]->network(); }

  // All on the io thread.
  net::ServerHandlers handlers() {
    net::ServerHandlers h;
    h.log = log_;
    h.state = [this] { return state_message(); };
    h.on_device = [this](bool attached, const net::DeviceInfo& device) {
      NetworkDevice& needle = network_device(device.needle);
      attached ? needle.attach() : needle.detach();
      if (is_ending_) return;  // that it leaves now is no fault of its own
      if (!device.takes_force) return;
      attached ? force_link_.attach(device) : force_link_.detach(device);
      start_cycling();
    };
    h.on_pose = [this](std::uint16_t needle, const NeedlePose& pose) { return on_pose(needle, pose); };
    h.on_drop = [this](std::uint16_t needle, bool pressed) { network_device(needle).press(pressed); };
    h.on_control = [this](const net::ControlMessage& message, const std::string& who) {
      return is_ending_ ? "the daemon is ending" : controls_.ask(message, who);
    };
    h.on_arm = [this](std::uint16_t needle, const std::string& who) { force_link_.arm(needle, who); };
    return h;
  }

  net::PoseVerdict on_pose(std::uint16_t needle, const NeedlePose& pose) {
    const PoseVerdict verdict = network_device(needle).submit(pose);
    const bool has_hand = force_link_.gate(needle).connected();
    if (verdict == PoseVerdict::kAccepted) {
      if (has_hand) force_link_.pose_accepted(needle, pose);
      return {};
    }
    if (verdict == PoseVerdict::kNotFinite && has_hand) force_link_.pose_not_finite(needle);
    return {false, static_cast<std::uint16_t>(verdict), std::string(to_string(verdict))};
  }

  ForceLinkOutputs force_outputs() {
    ForceLinkOutputs o;
    o.send_force = [this](const net::ForceMessage& message) { server_.send(message.needle, message); };
    o.send_model = [this](const net::LocalModelMessage& message) { server_.send(message.needle, message); };
    o.round_trip_s = [this](std::uint16_t needle) { return server_.round_trip_s(needle); };
    o.announce = [this](const net::EventMessage& event) {
      network_log_.warn("safety: " + event.text);
      server_.broadcast(event);
    };
    return o;
  }

  /// Keeps the forces going out for as long as there is a hand, or one that is being let go.
  void start_cycling() {
    if (is_cycling_ || is_ending_) return;
    is_cycling_ = true;
    cycle_timer_.expires_at(std::chrono::steady_clock::now());
    cycle_forces();
  }
  void cycle_forces() {
    const std::int64_t now_ns = monotonic_ns();
    take_tick(now_ns);
    force_link_.cycle(now_ns);
    is_cycling_ = force_link_.is_active();
    if (!is_cycling_) return;
    const auto now = std::chrono::steady_clock::now();  // a cycle that was missed is not made up for
    const auto due = cycle_timer_.expiry() + std::chrono::nanoseconds(force_link_.period_ns());
    cycle_timer_.expires_at(std::max(due, now));
    cycle_timer_.async_wait([this](const auto& error) {
      if (!error && !is_ending_) cycle_forces();
    });
  }

  /// The newest tick, if it is new.
  void take_tick(std::int64_t now_ns) {
    if (!force_reader_.update()) return;
    watch_.see(force_reader_.value().start_ns);
    force_link_.take(force_reader_.value(), now_ns);
  }

  /// One line for the service manager.
  std::string status() {
    loop_reader_.update();
    const LoopStatistics& loop = loop_reader_.value();
    const std::size_t clients = server_.client_count();
    return fmt::format("{}:{}, {} client{}, {} ticks, {} missed", server_.address(), server_.port(), clients,
                       clients == 1 ? "" : "s", loop.ticks, loop.overruns);
  }

  net::HttpOptions http_options(std::uint16_t port) {
    net::HttpOptions o;
    o.port = port;
    o.pages["/healthz"] = {false, [this] { return health(); }};
    o.pages["/metrics"] = {
        true, [this] {
          return net::MadePage::Content{200, "text/plain; version=0.0.4; charset=utf-8", metrics()};
        }};
    return o;
  }

  net::MadePage::Content health() {
    const std::string failure = watch_.failure();
    return {failure.empty() ? 200 : 503, "text/plain; charset=utf-8",
            (failure.empty() ? "ok" : failure) + "\n"};
  }

  std::string metrics() {
    const net::StateMessage state = server_.state();  // with it loop_reader_ and control_reader_ are new
    return metrics_text({.simd = std::string(to_string(simulator().simd_target())),
                         .start_time_s = start_time_s_,
                         .loop = loop_reader_.value(),
                         .control = control_reader_.value(),
                         .scene = controls_.scene(),
                         .state = state,
                         .clients = server_.role_counts(),
                         .igtl_clients = igtl_ ? igtl_->client_count() : 0,
                         .connections_refused = server_.gate().refused(),
                         .wrong_tokens = server_.gate().wrong_tokens(),
                         .forces_replaced = server_.forces_replaced(),
                         .interventions = force_link_.interventions(),
                         .seeds = seeds_,
                         .reloads_done = reload_.done(),
                         .reloads_refused = reload_.refused()});
  }

  /// Every so often, while the daemon runs.
  void report_next(std::int64_t start_ns) {
    report_timer_.expires_after(std::chrono::nanoseconds(std::llround(*options_.report_every_s * 1e9)));
    report_timer_.async_wait([this, start_ns](const auto& error) {
      if (error || is_ending_) return;
      loop_reader_.update();
      const double elapsed_s = 1e-9 * static_cast<double>(monotonic_ns() - start_ns);
      const auto interval = interval_report_.next(elapsed_s, loop_reader_.value(), server_.client_count());
      if (options_.json) {
        std::cout << to_json(interval) << std::endl;
      } else {
        spdlog::info("{}", to_text(interval));
      }
      report_next(start_ns);
    });
  }

  net::StateMessage state_message() {
    loop_reader_.update();
    control_reader_.update();
    const LoopStatistics& loop = loop_reader_.value();
    net::StateMessage m;
    m.ticks = loop.ticks;
    m.overruns = loop.overruns;
    m.control_overruns = control_reader_.value().overruns;
    m.tick_ms = quantiles_ms(loop.tick_ns);
    m.lateness_ms = quantiles_ms(loop.lateness_ns);
    m.latency_ms = quantiles_ms(loop.latency_ns);
    force_link_.add_to(m);
    m.controls = controls_.state();
    return m;
  }

  // On the snapshot thread.
  // A seed is in the ledger before anybody is told of it.
  void deliver(std::shared_ptr<const MeshState> state) {
    if (session_) keep(*state);
    boost::asio::post(io_, [this, run = state->run, seeds = state->seed_count] {
      seeds_ = seeds;
      controls_.seen(run);
      reload_.go_on();
    });
    for (net::EventMessage& event : events_.update(*state)) announce(std::move(event));
    if (igtl_) igtl_->publish(state);
    server_.publish(std::move(state));
  }
  void keep(const MeshState& state) {
    if (auto failure = session_->keep(state))
      announce({net::EventKind::kWarning, 0, state.tick, std::move(*failure)});
  }
  /// What came after the last snapshot; its thread has ended.
  void take_last_state() {
    if (!state_reader_.update()) return;
    if (session_) keep(state_reader_.value());
    events_.update(state_reader_.value());
  }

  // On the dose thread.
  DoseSettings dose_settings() const {
    DoseSettings settings = scene_.dose;
    if (plan_) settings.prescription_gy = plan_->prescription_gy;
    return settings;
  }
  void deliver_dose(net::DoseMessage message) {
    if (session_) session_->sync();
    boost::asio::post(io_, [this, message = std::move(message)] { server_.publish(message); });
  }

  void announce(net::EventMessage event) {
    boost::asio::post(io_, [this, event = std::move(event)] { server_.broadcast(event); });
  }

  Scene scene_;
  DaemonOptions options_;
  std::optional<net::BrokerOptions> broker_;  // none: nothing is published
  std::optional<Plan> plan_;
  std::vector<Structure> structures_;
  std::unique_ptr<RecordedSession> session_;  // snapshot thread; its sync the dose thread; null: none
  boost::asio::io_context io_{1};
  boost::asio::thread_pool workers_{1};  // makes simulators, seldom
  SimulationRuns runs_;                  // io thread; its reader the deformation thread
  TripleBuffer<MeshState> states_;
  TripleBuffer<MeshState>::Writer state_writer_ = states_.writer();  // deformation thread
  TripleBuffer<MeshState>::Reader state_reader_ = states_.reader();  // snapshot thread
  TripleBuffer<FallenSeeds> fallen_;
  TripleBuffer<FallenSeeds>::Writer fallen_writer_ = fallen_.writer();  // deformation thread
  TripleBuffer<FallenSeeds>::Reader fallen_reader_ = fallen_.reader();  // dose thread
  std::size_t needle_count_;
  std::vector<std::unique_ptr<SwitchedDevice>> devices_;  // by needle
  TripleBuffer<TickForces> tick_forces_;
  TripleBuffer<TickForces>::Writer force_writer_ = tick_forces_.writer();  // deformation thread
  TripleBuffer<TickForces>::Reader force_reader_ = tick_forces_.reader();  // io thread
  TripleBuffer<LoopStatistics> loop_;
  TripleBuffer<LoopStatistics>::Writer loop_writer_ = loop_.writer();  // deformation thread
  TripleBuffer<LoopStatistics>::Reader loop_reader_ = loop_.reader();  // io thread
  TripleBuffer<LoopStatistics> control_;
  TripleBuffer<LoopStatistics>::Writer control_writer_ = control_.writer();  // control thread
  TripleBuffer<LoopStatistics>::Reader control_reader_ = control_.reader();  // io thread
  TickEvents events_;                                                        // snapshot thread

  boost::asio::signal_set signals_{io_, SIGINT,
                                   SIGTERM};  // from here on: one that comes before run() is not lost
  NetworkLog network_log_;                    // io thread
  const std::function<void(const std::string&)> log_ = [this](const std::string& line) {
    network_log_.info(line);
  };
  boost::asio::steady_timer cycle_timer_{io_};
  ForceLink force_link_;  // io thread, as the two below
  boost::asio::steady_timer report_timer_{io_};
  IntervalReport interval_report_;  // io thread
  bool is_cycling_ = false;
  bool is_ending_ = false;
  net::Server server_;
  std::optional<net::HttpListener> http_;      // its sessions are server_'s
  std::optional<net::igtl::IgtlServer> igtl_;  // none: off
  std::optional<net::Publisher> publisher_;    // none: off; its run() a thread's of its own
  Controls controls_;                          // io thread, as all below
  ServiceWatch watch_;
  SceneReload reload_;
  const double start_time_s_ = wall_clock_s();
  std::uint32_t seeds_ = 0;  // of the newest snapshot
  std::function<void()> end_ = [] {};
};

Daemon::Daemon(const Scene& scene, const DaemonOptions& options)
    : impl_(std::make_unique<Impl>(scene, options)) {}
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
