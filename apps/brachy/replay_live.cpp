#include <fmt/format.h>

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/client_run.h"
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
    c.limits.rate_hz = options.rate_hz;
    return c;
  }

  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    h.on_welcome = [this](const net::WelcomeMessage& welcome) {
      if (options_.rate_hz > welcome.max_poses_per_s)
        std::cerr << fmt::format(
            "brachy replay: --rate-hz {} is above what the daemon takes ({}); the rest is lost\n",
            options_.rate_hz, welcome.max_poses_per_s);
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
    h.on_error = [this](const net::ErrorMessage& error) {
      if (!error.fatal && refusals_shown_++ < 5) std::cerr << "brachy replay: " << error.text << "\n";
    };
    return h;
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
    trajectory_ = place(NeedleTrajectories({{0, std::move(trajectory_)}}), options_, options_.centre_on_tissue,
                        0.5 * (min + max))
                      .needles()[0]
                      .motion;
    begin_ = Clock::now();
    first_stamp_ns_ = monotonic_ns();
    send();
  }

  // Poses leave on a fixed grid of times; those we wake too late for are left out, not sent in a burst.
  void send() {
    const double elapsed_s = std::chrono::duration<double>(Clock::now() - begin_).count();
    const double duration_s = trajectory_.duration_s();
    double t_s = elapsed_s;
    if (options_.loop && duration_s > 0) t_s = std::fmod(t_s, duration_s);
    const bool last = !options_.loop && elapsed_s >= duration_s;
    run_.client().send_pose(trajectory_.sample(trajectory_.start_s() + std::min(t_s, duration_s)),
                            monotonic_ns());
    if (last) {
      played_ = true;
      timer_.expires_after(std::chrono::milliseconds(200));  // for the last poses to come back
      timer_.async_wait([this](const auto& error) {
        if (!error) run_.finish();
      });
      return;
    }
    const double next = std::floor(elapsed_s * options_.rate_hz) + 1;
    timer_.expires_at(begin_ + std::chrono::nanoseconds(std::llround(next / options_.rate_hz * 1e9)));
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
      std::cout << json.dump() << "\n";
      return;
    }
    std::cout << fmt::format(
        "replay: {} poses sent in {:.1f} s, {} accepted, {} refused; pose to mesh and back: p50 {:.1f} ms, "
        "p99 {:.1f} "
        "ms\n  deepest insertion {:.1f} mm, largest displacement {:.2f} mm\n",
        run_.client().poses_sent(), trajectory_.duration_s(), accepted, turned_down,
        1e-6 * static_cast<double>(round_trip_.quantile(0.5)),
        1e-6 * static_cast<double>(round_trip_.quantile(0.99)), deepest_, max_displacement_);
  }

  ReplayOptions options_;
  Trajectory trajectory_;
  bool started_ = false, played_ = false;
  Clock::time_point begin_;
  std::int64_t first_stamp_ns_ = 0;
  std::uint64_t last_input_ = 0;
  int refusals_shown_ = 0;
  double max_displacement_ = 0, deepest_ = 0;
  Histogram round_trip_;
  ClientRun run_;
  boost::asio::steady_timer timer_;
};

}  // namespace

int replay_live(const ReplayOptions& options) {
  return LiveReplay(options, load_trajectory(options.trajectory)).run();
}

}  // namespace brachy
