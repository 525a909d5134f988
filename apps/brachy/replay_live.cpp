#include <fmt/format.h>

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/client_run.h"
#include "apps/brachy/live_device.h"
#include "apps/brachy/place_trajectory.h"
#include "apps/brachy/quantiles.h"
#include "apps/brachy/tools.h"
#include "core/realtime/deadline.h"
#include "core/realtime/histogram.h"

namespace brachy {
namespace {

/// The mock device: plays a trajectory over TCP and measures how long its poses take to come back as meshes.
class LiveReplay {
 public:
  LiveReplay(const ReplayOptions& options, Trajectory trajectory)
      : options_(options),
        trajectory_(std::move(trajectory)),
        run_(client_options(options), handlers()),
        timer_(run_.io()) {}

  int run() {
    run_.run(*options_.connect, std::nullopt);
    std::string failure = run_.failure();
    if (run_.server_stopped() && !options_.loop && !played_)
      failure = "the daemon stopped before the trajectory's end";
    if (!failure.empty()) {
      std::cerr << "brachy replay: " << failure << "\n";
      return kExitFailed;
    }
    report();
    return kExitOk;
  }

 private:
  using Clock = std::chrono::steady_clock;

  static net::ClientOptions client_options(const ReplayOptions& options) {
    net::ClientOptions c;
    c.role = net::Role::kDevice;
    c.name = "brachy replay";
    const SimulatedDeviceOptions device = options.device.value_or(SimulatedDeviceOptions{});
    c.limits.rate_hz = options.device ? device.rate_hz : options.rate_hz;
    c.limits.max_force_n = device.max_force_n;
    c.limits.damping_n_s_per_mm = 1e-3 * device.damping_n_s_per_m;
    // What it adds of delay no PING shows.
    if (options.device) c.limits.max_stiffness_n_per_mm = loop_settings(device).limits.max_stiffness_n_per_mm;
    c.evaluates_local_model = options.device && !device.simple_client;
    return c;
  }

  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    h.on_welcome = [this](const net::WelcomeMessage& welcome) {
      if (rate_hz() > welcome.max_poses_per_s)
        std::cerr << fmt::format(
            "brachy replay: {} poses a second are above what the daemon takes ({}); the rest is lost\n",
            rate_hz(), welcome.max_poses_per_s);
      run_.client().request_state();  // what was counted before us
    };
    h.on_topology = [this](const net::TopologyMessage& topology) { start(topology); };
    h.on_frame = [this](const net::FrameMessage& frame) {
      if (frame.input_sequence == last_input_ || frame.input_stamp_ns < first_stamp_ns_) return;
      last_input_ = frame.input_sequence;
      round_trip_.record(monotonic_ns() - frame.input_stamp_ns);
      max_displacement_ = std::max(max_displacement_, frame.max_displacement_mm);
      if (!frame.needles.empty()) deepest_ = std::max(deepest_, frame.needles[0].state.insertion_depth_mm);
    };
    h.on_force = [this](const net::ForceMessage& force) {
      arm_if_latched_before_us(force.flags);
      if (device_) device_->take(force.forces.force_n, monotonic_ns());
    };
    h.on_local_model = [this](const net::LocalModelMessage& local) {
      arm_if_latched_before_us(local.flags);
      if (device_) device_->take(local.model, local.input_stamp_ns, monotonic_ns());
    };
    h.on_error = [this](const net::ErrorMessage& error) {
      if (!error.fatal && refusals_shown_++ < 5) std::cerr << "brachy replay: " << error.text << "\n";
    };
    return h;
  }

  // A predecessor's fault is not ours; one that comes later stays, so that it is seen.
  void arm_if_latched_before_us(std::uint16_t flags) {
    if (!heard_of_force_ && (flags & net::kForceLatched) != 0) run_.client().arm();
    heard_of_force_ = true;
  }

  void start(const net::TopologyMessage& topology) {
    if (started_) return;
    started_ = true;
    Vec3 min = Vec3::Constant(INFINITY), max = Vec3::Constant(-INFINITY);
    for (std::size_t i = 0; i + 2 < topology.rest_vertices.size(); i += 3) {
      const Vec3 x(topology.rest_vertices[i], topology.rest_vertices[i + 1], topology.rest_vertices[i + 2]);
      min = min.cwiseMin(x);
      max = max.cwiseMax(x);
    }
    trajectory_ = place(NeedleTrajectories({{0, std::move(trajectory_)}}), options_,
                        options_.centre_on_tissue, 0.5 * (min + max))
                      .needles()[0]
                      .motion;
    begin_ = Clock::now();
    first_stamp_ns_ = monotonic_ns();
    if (options_.device)
      device_.emplace(
          *options_.device, [this](double t_s) { return pose_at(t_s); }, first_stamp_ns_);
    send();
  }

  // Of the needle, or of the hand that holds the device.
  RigidTransform pose_at(double elapsed_s) const {
    const double duration_s = trajectory_.duration_s();
    const double t_s = options_.loop && duration_s > 0 ? std::fmod(elapsed_s, duration_s) : elapsed_s;
    return trajectory_.sample(trajectory_.start_s() + std::min(t_s, duration_s));
  }

  void send_pose(double elapsed_s) {
    const std::int64_t now_ns = monotonic_ns();
    if (!device_)
      run_.client().send_pose(pose_at(elapsed_s), now_ns);
    else if (const auto pose = device_->advance(now_ns))
      run_.client().send_pose(pose->X_WN, pose->stamp_ns);
  }

  double rate_hz() const { return options_.device ? options_.device->rate_hz : options_.rate_hz; }

  // Poses leave on a fixed grid of times; those we wake too late for are left out, not sent in a burst.
  void send() {
    const double elapsed_s = std::chrono::duration<double>(Clock::now() - begin_).count();
    const bool last = !options_.loop && elapsed_s >= trajectory_.duration_s();
    send_pose(elapsed_s);
    if (last) {
      played_ = true;
      timer_.expires_after(std::chrono::milliseconds(200));  // for the last poses to come back
      timer_.async_wait([this](const auto& error) {
        if (!error) run_.finish();
      });
      return;
    }
    const double next = std::floor(elapsed_s * rate_hz()) + 1;
    timer_.expires_at(begin_ + std::chrono::nanoseconds(std::llround(next / rate_hz() * 1e9)));
    timer_.async_wait([this](const auto& error) {
      if (!error && run_.client().is_open()) send();
    });
  }

  static std::uint64_t refused(const net::StateMessage& state) {
    std::uint64_t count = 0;
    for (const net::PoseRefusals& r : state.refusals) count += r.count;
    return count;
  }

  void report() {
    const std::uint64_t accepted = run_.last_state().poses_accepted - run_.first_state().poses_accepted;
    const std::uint64_t turned_down = refused(run_.last_state()) - refused(run_.first_state());
    if (options_.json) {
      const nlohmann::ordered_json json = {{"poses_sent", run_.client().poses_sent()},
                                           {"poses_accepted", accepted},
                                           {"poses_refused", turned_down},
                                           {"poses_dropped", run_.client().poses_dropped()},
                                           {"duration_s", trajectory_.duration_s()},
                                           {"round_trip_ms", to_json_ms(round_trip_)},
                                           {"max_disp_mm", max_displacement_},
                                           {"max_depth_mm", deepest_}};
      std::cout << with_hand(json.dump() + "\n", options_.device, hand());
      return;
    }
    std::cout << fmt::format(
                     "replay: {} poses sent in {:.1f} s, {} accepted, {} refused; pose to mesh and back: p50 "
                     "{:.1f} ms, "
                     "p99 {:.1f} "
                     "ms\n  deepest insertion {:.1f} mm, largest displacement {:.2f} mm\n",
                     run_.client().poses_sent(), trajectory_.duration_s(), accepted, turned_down,
                     1e-6 * static_cast<double>(round_trip_.quantile(0.5)),
                     1e-6 * static_cast<double>(round_trip_.quantile(0.99)), deepest_, max_displacement_)
              << to_text(options_.device, hand());
  }

  HandReport hand() const { return device_ ? device_->report() : HandReport(); }

  ReplayOptions options_;
  Trajectory trajectory_;
  bool started_ = false, played_ = false, heard_of_force_ = false;
  Clock::time_point begin_;
  std::int64_t first_stamp_ns_ = 0;
  std::uint64_t last_input_ = 0;
  int refusals_shown_ = 0;
  double max_displacement_ = 0, deepest_ = 0;
  Histogram round_trip_;
  std::optional<LiveDevice> device_;
  ClientRun run_;
  boost::asio::steady_timer timer_;
};

}  // namespace

int replay_live(const ReplayOptions& options) {
  return LiveReplay(options, load_trajectory(options.trajectory)).run();
}

}  // namespace brachy
