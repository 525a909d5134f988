#include "apps/brachyd/daemon.h"

#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <future>
#include <optional>
#include <thread>

#include "apps/brachyd/deformation_loop.h"
#include "apps/brachyd/guard_events.h"
#include "apps/brachyd/snapshot_loop.h"
#include "apps/tissue_box.h"
#include "core/realtime/deadline.h"
#include "core/realtime/realtime_thread.h"
#include "core/scene/load_tissue.h"
#include "haptics/network_device.h"
#include "haptics/scripted_device.h"
#include "net/server.h"

namespace brachy {
namespace {

Simulator make_simulator(const Scene& scene) {
  LoadedTissue loaded = load_tissue(scene);
  const SurfaceReport& report = loaded.report;
  spdlog::info("tissue: {} points, {} on the surface, {:.1f} cc", loaded.tissue.size(),
               loaded.tissue.surface_count, report.volume_cc);
  if (report.dropped_islands)
    spdlog::warn("tissue: {} islands of {:.2g} cc together were dropped", report.dropped_islands,
                 report.dropped_island_volume_cc);
  if (report.flipped_triangles)
    spdlog::info("tissue: {} triangles turned outwards", report.flipped_triangles);
  return Simulator(scene, std::move(loaded.tissue));
}

std::unique_ptr<Device> make_device(const Scene& scene, const Tissue& tissue) {
  if (scene.device.kind == "scripted") {
    Trajectory trajectory = load_trajectory(scene.resolve(scene.device.trajectory));
    if (scene.device.centre_on_tissue) trajectory = trajectory.centred_on(centre_of(tissue));
    return std::make_unique<ScriptedDevice>(std::move(trajectory), scene.device.loop);
  }
  return std::make_unique<NetworkDevice>(
      PoseGuardSettings{static_cast<std::int64_t>(scene.device.stale_pose_ms * 1e6)});
}

net::ServerOptions server_options(const Scene& scene, const DaemonOptions& options) {
  net::ServerOptions s;
  s.address = scene.server.address;
  s.port = static_cast<std::uint16_t>(options.port.value_or(scene.server.port));
  s.allow_remote = options.insecure_allow_remote;
  s.max_clients = static_cast<std::uint32_t>(scene.server.max_clients);
  s.max_message_bytes = static_cast<std::uint32_t>(scene.server.max_message_bytes);
  s.max_poses_per_s = static_cast<std::uint32_t>(scene.server.max_poses_per_s);
  s.server_name = "brachyd " BRACHY_VERSION;
  s.topology_name = scene.name;
  s.deformation_hz = scene.rates.deformation_hz;
  s.snapshot_hz = scene.rates.snapshot_hz;
  return s;
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
        simulator_(make_simulator(scene)),
        device_(make_device(scene, simulator_.tissue())),
        network_device_(dynamic_cast<NetworkDevice*>(device_.get())),
        states_(simulator_.initial_state()),
        server_(io_, server_options(scene, options), simulator_.tissue(), handlers()) {
    spdlog::info("engine: {}, {} thread{}", to_string(simulator_.simd_target()), scene.engine.threads,
                 scene.engine.threads == 1 ? "" : "s");
    if (!network_device_) server_.hold_lease(0, "scripted device: " + scene.device.trajectory);
  }

  const net::Server& server() const { return server_; }

  DaemonSummary run() {
    boost::asio::steady_timer duration(io_);
    const auto end = [&] {
      signals_.cancel();
      duration.cancel();
      server_.stop();
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
    const std::int64_t start_ns = monotonic_ns();
    std::promise<std::string> granted;
    std::jthread deformation([&](const std::stop_token& stop) {
      granted.set_value(
          to_string(request_realtime({scene_.realtime.fifo_priority, scene_.realtime.lock_memory})));
      run_deformation_loop(stop, simulator_, *device_, state_writer_, loop_writer_);
    });
    std::jthread snapshots([&](const std::stop_token& stop) {
      summary.snapshots = run_snapshot_loop(stop, scene_.rates.snapshot_hz, state_reader_,
                                            [&](auto state) { deliver(std::move(state)); });
    });
    std::jthread control;
    if (options_.control_thread || scene_.realtime.control_thread)
      control = std::jthread([&](const std::stop_token& stop) {
        request_realtime({scene_.realtime.fifo_priority, false});  // woken on the same terms
        run_control_loop(stop, simulator_.period_s(), control_writer_);
      });
    summary.realtime = granted.get_future().get();
    if (scene_.realtime.fifo_priority || scene_.realtime.lock_memory) spdlog::info("{}", summary.realtime);

    io_.run();

    for (std::jthread* thread : {&deformation, &snapshots, &control}) thread->request_stop();
    for (std::jthread* thread : {&deformation, &snapshots, &control})
      if (thread->joinable()) thread->join();
    summary.elapsed_s = 1e-9 * static_cast<double>(monotonic_ns() - start_ns);
    loop_reader_.update();
    control_reader_.update();
    summary.loop = loop_reader_.value();
    summary.control = control_reader_.value();
    summary.simd = to_string(simulator_.simd_target());
    summary.evaluations = simulator_.evaluation_counts();  // its thread has ended
    if (network_device_) {
      summary.poses_accepted = network_device_->guard().count(PoseVerdict::kAccepted);
      summary.poses_refused = network_device_->guard().refused();
    }
    return summary;
  }

  void stop() {
    boost::asio::post(io_, [this] { end_(); });
  }

 private:
  // All on the io thread.
  net::ServerHandlers handlers() {
    net::ServerHandlers h;
    h.log = [](const std::string& line) { spdlog::info("{}", line); };
    h.state = [this] { return state_message(); };
    h.on_device = [this](bool attached, const net::DeviceInfo&) {
      if (network_device_) attached ? network_device_->attach() : network_device_->detach();
    };
    h.on_pose = [this](std::uint16_t, const NeedlePose& pose) -> net::PoseVerdict {
      const PoseVerdict verdict = network_device_->submit(pose);
      if (verdict == PoseVerdict::kAccepted) return {};
      return {false, static_cast<std::uint16_t>(verdict), std::string(to_string(verdict))};
    };
    return h;
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
    return m;
  }

  // On the snapshot thread.
  void deliver(std::shared_ptr<const MeshState> state) {
    const NeedleState& needle = state->needles[0];
    if (needle.puncture_count != last_needle_.puncture_count)
      announce({net::EventKind::kPuncture, 0, state->tick, "capsule punctured"});
    if (needle.contact != last_needle_.contact)
      announce({net::EventKind::kContact, 0, state->tick, std::string(to_string(needle.contact))});
    last_needle_ = needle;
    if (auto warning = guard_events_.update(*state))
      announce({net::EventKind::kWarning, 0, state->tick, std::move(*warning)});
    server_.publish(std::move(state));
  }
  void announce(net::EventMessage event) {
    boost::asio::post(io_, [this, event = std::move(event)] { server_.broadcast(event); });
  }

  Scene scene_;
  DaemonOptions options_;
  Simulator simulator_;
  std::unique_ptr<Device> device_;
  NetworkDevice* network_device_;  // device_, where it is one

  TripleBuffer<MeshState> states_;
  TripleBuffer<MeshState>::Writer state_writer_ = states_.writer();  // deformation thread
  TripleBuffer<MeshState>::Reader state_reader_ = states_.reader();  // snapshot thread
  TripleBuffer<LoopStatistics> loop_;
  TripleBuffer<LoopStatistics>::Writer loop_writer_ = loop_.writer();  // deformation thread
  TripleBuffer<LoopStatistics>::Reader loop_reader_ = loop_.reader();  // io thread
  TripleBuffer<LoopStatistics> control_;
  TripleBuffer<LoopStatistics>::Writer control_writer_ = control_.writer();  // control thread
  TripleBuffer<LoopStatistics>::Reader control_reader_ = control_.reader();  // io thread
  NeedleState last_needle_;                                                  // snapshot thread
  GuardEvents guard_events_;                                                 // snapshot thread

  boost::asio::io_context io_{1};
  boost::asio::signal_set signals_{io_, SIGINT,
                                   SIGTERM};  // from here on: one that comes before run() is not lost
  net::Server server_;
  std::function<void()> end_ = [] {};
};

Daemon::Daemon(const Scene& scene, const DaemonOptions& options)
    : impl_(std::make_unique<Impl>(scene, options)) {}
Daemon::~Daemon() = default;
std::uint16_t Daemon::port() const {
  return impl_->server().port();
}
const std::string& Daemon::address() const {
  return impl_->server().address();
}
DaemonSummary Daemon::run() {
  return impl_->run();
}
void Daemon::stop() {
  impl_->stop();
}

}  // namespace brachy
