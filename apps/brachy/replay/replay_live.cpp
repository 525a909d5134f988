#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cmath>
#include <deque>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "apps/brachy/live/client_run.h"
#include "apps/brachy/replay/live_device.h"
#include "apps/brachy/replay/load_motion.h"
#include "apps/brachy/replay/place_trajectory.h"
#include "apps/brachy/replay/replay.h"
#include "apps/command_line/exit_code.h"
#include "apps/reports/quantiles.h"
#include "core/realtime/deadline.h"
#include "core/realtime/histogram.h"

namespace brachy {
namespace {

/// The mock devices: play a trajectory file over TCP, each needle on a connection of its own, and measure how long
/// poses take to come back as meshes. The first needle's connection is the one that follows the daemon.
class LiveReplay {
 public:
  LiveReplay(const ReplayOptions& options, NeedleTrajectories trajectories)
      : options_(options),
        trajectories_(std::move(trajectories)),
        connection_(client_options_for(*options.connect)),
        run_(client_options(0), handlers()),
        timer_(run_.io()) {
    for (std::size_t i = 1; i < trajectories_.needles().size(); ++i) {
      net::ClientOptions c = client_options(i);
      c.subscription = net::kSubscribeNoMesh;
      others_.push_back(std::make_unique<net::Client>(run_.io(), std::move(c), other_handlers(i)));
    }
  }

  int run() {
    for (auto& other : others_) other->connect(options_.connect->host, options_.connect->port);
    run_.run(*options_.connect, std::nullopt);
    std::string failure = run_.failure().empty() ? failure_ : run_.failure();
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
  static constexpr double kHeldS = 0.2;

  std::uint32_t id_of(std::size_t i) const { return trajectories_.needles()[i].id; }
  net::Client& client_of(std::size_t i) { return i == 0 ? run_.client() : *others_[i - 1]; }

  net::ClientOptions client_options(std::size_t i) const {
    net::ClientOptions c = connection_;
    c.role = net::Role::kDevice;
    c.needle = static_cast<std::uint16_t>(id_of(i));
    c.name =
        trajectories_.needles().size() == 1 ? "brachy replay" : fmt::format("brachy replay {}", id_of(i));
    const SimulatedDeviceOptions device = options_.device.value_or(SimulatedDeviceOptions{});
    c.limits.rate_hz = rate_hz();
    c.limits.max_force_n = device.max_force_n;
    c.limits.damping_n_s_per_mm = 1e-3 * device.damping_n_s_per_m;
    if (i > 0 || !options_.device) return c;
    // A PING does not show the delay that it adds.
    c.limits.max_stiffness_n_per_mm = loop_settings(device).limits.max_stiffness_n_per_mm;
    c.evaluates_local_model = !device.simple_client;
    return c;
  }

  double rate_hz() const { return options_.device ? options_.device->rate_hz : options_.rate_hz; }

  // Clears a fault latched before this client; a later fault stays latched, so that it is reported.
  void note_latch(std::size_t i, std::uint16_t flags) {
    Felt& felt = felt_[i];
    const bool is_latched = (flags & net::kForceLatched) != 0;
    if (!felt.is_heard_of && is_latched) client_of(i).arm();
    felt.is_removed |= felt.is_free && is_latched;
    felt.is_free |= !is_latched;
    felt.is_heard_of = true;
  }

  std::ptrdiff_t forces_removed() const { return std::ranges::count(felt_, true, &Felt::is_removed); }

  void feel(net::ClientHandlers& h, std::size_t i) {
    h.on_force = [this, i](const net::ForceMessage& force) {
      note_latch(i, force.flags);
      if (i == 0 && device_) device_->take(force, monotonic_ns());
    };
    h.on_local_model = [this, i](const net::LocalModelMessage& local) {
      note_latch(i, local.flags);
      if (i == 0 && device_) device_->take(local.model, local.input_stamp_ns, monotonic_ns());
    };
  }

  void show_refusal(const net::ErrorMessage& error) {
    if (!error.fatal && refusals_shown_++ < 5) std::cerr << "brachy replay: " << error.text << "\n";
  }

  // The first failure is the cause of the others.
  void fail(std::size_t i, const std::string& what, net::ErrorCode code = {}) {
    if (!failure_.empty()) return;
    failure_ = fmt::format("needle {}: {}", id_of(i), what);
    if (code == net::ErrorCode::kNoNeedle) failure_ += "; raise needle.count in the daemon's scene";
  }

  net::ClientHandlers other_handlers(std::size_t i) {
    net::ClientHandlers h;
    feel(h, i);
    h.on_welcome = [this](const net::WelcomeMessage&) { start_when_ready(); };
    h.on_error = [this, i](const net::ErrorMessage& error) {
      if (error.fatal && error.code != net::ErrorCode::kShutdown) fail(i, error.text, error.code);
      show_refusal(error);
    };
    h.on_closed = [this, i](const std::string& reason) {
      if (!run_.server_stopped()) fail(i, reason);
      run_.finish();
    };
    return h;
  }

  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    feel(h, 0);
    h.on_welcome = [this](const net::WelcomeMessage& welcome) {
      if (rate_hz() > welcome.max_poses_per_s)
        std::cerr << fmt::format(
            "brachy replay: {} poses per second exceed the daemon's limit ({}); the rest is lost\n",
            rate_hz(), welcome.max_poses_per_s);
      run_.client().request_state();  // counters before this client
    };
    h.on_state = [this](const net::StateMessage&) {
      if (!std::exchange(counted_, true)) start_when_ready();
    };
    h.on_topology = [this](const net::TopologyMessage& topology) { start(topology); };
    h.on_frame = [this](const net::FrameMessage& frame) {
      // Matched by its stamp: the needles' connections have separate counters but one clock.
      if (frame.input_stamp_ns == last_input_ns_ || frame.input_stamp_ns < first_stamp_ns_) return;
      last_input_ns_ = frame.input_stamp_ns;
      const std::int64_t now_ns = monotonic_ns();
      round_trip_.record(now_ns - frame.input_stamp_ns);
      for (; !unseen_ns_.empty() && unseen_ns_.front() <= frame.input_stamp_ns; unseen_ns_.pop_front())
        to_vertices_.record(now_ns - unseen_ns_.front());
      max_displacement_ = std::max(max_displacement_, frame.max_displacement_mm);
      for (const net::NeedleRecord& needle : frame.needles)
        deepest_ = std::max(deepest_, needle.state.insertion_depth_mm);
    };
    h.on_error = [this](const net::ErrorMessage& error) { show_refusal(error); };
    h.on_event = [this](const net::EventMessage& event) { show_safety(event); };
    return h;
  }

  // Why the daemon took the force of one of our needles away, and what to do about it; not what it only limits.
  void show_safety(const net::EventMessage& event) {
    const auto is_its = [&](const auto& needle) { return needle.id == event.needle; };
    if (event.kind == net::EventKind::kSafety && event.text.find("force removed") != std::string::npos &&
        std::ranges::any_of(trajectories_.needles(), is_its))
      std::cerr << fmt::format("brachy replay: tick {}: {}\n", event.tick, event.text);
  }

  void start(const net::TopologyMessage& topology) {
    if (placed_) return;
    placed_ = true;
    Vec3 min = Vec3::Constant(INFINITY), max = Vec3::Constant(-INFINITY);
    for (std::size_t i = 0; i + 2 < topology.rest_vertices.size(); i += 3) {
      const Vec3 x(topology.rest_vertices[i], topology.rest_vertices[i + 1], topology.rest_vertices[i + 2]);
      min = min.cwiseMin(x);
      max = max.cwiseMax(x);
    }
    trajectories_ = place(std::move(trajectories_), options_, options_.centre_on_tissue, 0.5 * (min + max));
    start_when_ready();
  }

  // Starts the common clock once every needle is granted and the tissue and the daemon's counters are known.
  void start_when_ready() {
    const std::size_t awaited = others_.size() + 2;
    if (++ready_ != awaited) return;
    begin_ = Clock::now();
    first_stamp_ns_ = monotonic_ns();
    if (options_.device)
      device_.emplace(
          *options_.device, [this](double t_s) { return hand_at(t_s); }, first_stamp_ns_);
    send();
  }

  // Poses are sent on a fixed time grid; those missed by a late wake-up are skipped, not sent in a burst.
  void send() {
    const double elapsed_s = std::chrono::duration<double>(Clock::now() - begin_).count();
    const double duration_s = trajectories_.duration_s();
    played_ = !options_.loop && elapsed_s >= duration_s;
    // The last pose is held for its mesh to come back; then the end comes before the daemon misses poses.
    const bool last = !options_.loop && elapsed_s >= duration_s + kHeldS;
    send_poses(played_s(elapsed_s));
    if (last) {
      timer_.expires_after(std::chrono::milliseconds(30));
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

  // The trajectories' time.
  double played_s(double elapsed_s) const {
    const double duration_s = trajectories_.duration_s();
    const double t_s = options_.loop && duration_s > 0 ? std::fmod(elapsed_s, duration_s) : elapsed_s;
    return trajectories_.start_s() + std::min(t_s, duration_s);
  }

  RigidTransform hand_at(double elapsed_s) const {
    return trajectories_.needles()[0].motion.sample(played_s(elapsed_s));
  }

  // The protocol cannot remove a needle: when looping, it waits at its last pose for its first row.
  void send_poses(double t_s) {
    const std::int64_t now_ns = monotonic_ns();
    for (std::size_t i = 0; i < trajectories_.needles().size(); ++i) {
      const auto& needle = trajectories_.needles()[i];
      net::Client& client = client_of(i);
      if (i == 0 && device_) {
        if (const auto pose = device_->advance(now_ns)) send_pose(i, pose->X_WN, pose->stamp_ns);
        press(i, t_s);
        continue;
      }
      press(i, t_s);
      if (const auto X_WN = trajectories_.sample(needle.id, t_s))
        send_pose(i, *X_WN, now_ns);
      else if (client.poses_sent() > 0)
        send_pose(i, needle.motion.samples().back().X_WN, now_ns);
    }
  }

  void send_pose(std::size_t i, const RigidTransform& X_WN, std::int64_t stamp_ns) {
    client_of(i).send_pose(X_WN, stamp_ns);
    if (i == 0) unseen_ns_.push_back(stamp_ns);
  }

  // A press between two poses is sent with the later one, however short it was.
  void press(std::size_t i, double t_s) {
    const std::uint32_t id = id_of(i);
    Button& button = buttons_[id];
    const bool starts_over = t_s < button.last_s;
    const bool is_down =
        starts_over ? trajectories_.button(id, t_s) : trajectories_.button(id, button.last_s, t_s);
    button.last_s = t_s;
    if (is_down != std::exchange(button.is_down, is_down)) client_of(i).press(is_down);
  }

  static std::uint64_t refused(const net::StateMessage& state) {
    std::uint64_t count = 0;
    for (const net::PoseRefusals& r : state.refusals) count += r.count;
    return count;
  }

  void report() {
    std::uint64_t sent = 0, dropped = 0;
    for (std::size_t i = 0; i < trajectories_.needles().size(); ++i) {
      sent += client_of(i).poses_sent();
      dropped += client_of(i).poses_dropped();
    }
    const std::uint64_t accepted = run_.last_state().poses_accepted - run_.first_state().poses_accepted;
    const std::uint64_t turned_down = refused(run_.last_state()) - refused(run_.first_state());
    if (options_.json) {
      const nlohmann::ordered_json json = {{"poses_sent", sent},
                                           {"poses_accepted", accepted},
                                           {"poses_refused", turned_down},
                                           {"poses_dropped", dropped},
                                           {"needles", trajectories_.needles().size()},
                                           {"duration_s", trajectories_.duration_s()},
                                           {"pose_to_vertices_ms", to_json_ms(to_vertices_)},
                                           {"round_trip_ms", to_json_ms(round_trip_)},
                                           {"max_disp_mm", max_displacement_},
                                           {"max_depth_mm", deepest_},
                                           {"seeds", seeds()},
                                           {"forces_removed", forces_removed()}};
      std::cout << with_hand(json.dump() + "\n", options_.device, hand());
      return;
    }
    std::cout
        << fmt::format(
               "replay: {} poses sent in {:.1f} s, {} accepted, {} refused\n"
               "  from a pose to the vertices that follow it: p50 {:.1f} ms, p99 {:.1f} ms; of the poses "
               "that snapshots used: p50 {:.1f} ms, p99 {:.1f} ms\n"
               "  deepest insertion {:.1f} mm, largest displacement {:.2f} mm{}\n",
               sent, trajectories_.duration_s(), accepted, turned_down, ms(to_vertices_, 0.5),
               ms(to_vertices_, 0.99), ms(round_trip_, 0.5), ms(round_trip_, 0.99), deepest_,
               max_displacement_, seeds() ? fmt::format("; {} seeds in the tissue", seeds()) : "")
        << (forces_removed()
                ? fmt::format("  the daemon removed the force of {} needles: see its messages above\n",
                              forces_removed())
                : "")
        << to_text(options_.device, hand());
  }

  static double ms(const Histogram& ns, double q) { return 1e-6 * static_cast<double>(ns.quantile(q)); }
  std::size_t seeds() const { return run_.client().mesh().seeds().size(); }
  HandReport hand() const { return device_ ? device_->report() : HandReport(); }

  ReplayOptions options_;
  NeedleTrajectories trajectories_;
  net::ClientOptions connection_;  // token and TLS, the same for every needle
  bool counted_ = false, placed_ = false, played_ = false;
  std::size_t ready_ = 0;  // of the others' WELCOMEs, our TOPOLOGY and our first STATE
  std::string failure_;    // of one of the others
  Clock::time_point begin_;
  std::int64_t first_stamp_ns_ = 0;
  std::int64_t last_input_ns_ = 0;
  int refusals_shown_ = 0;
  double max_displacement_ = 0, deepest_ = 0;
  std::deque<std::int64_t> unseen_ns_;  // stamps of the first needle's poses that no snapshot has shown
  Histogram to_vertices_;               // of every pose: until the first vertices that know it or a later one
  Histogram round_trip_;                // of those poses that a snapshot used
  /// What the daemon has said of a needle's force: at all, that it is not latched, that it was latched after that.
  struct Felt {
    bool is_heard_of = false, is_free = false, is_removed = false;
  };
  std::array<Felt, kMaxTrajectoryNeedles> felt_{};
  struct Button {
    bool is_down = false;
    double last_s = -INFINITY;  // time up to which presses were sent
  };
  std::array<Button, kMaxTrajectoryNeedles> buttons_;
  std::optional<LiveDevice> device_;  // that moves the first needle
  ClientRun run_;
  std::vector<std::unique_ptr<net::Client>> others_;  // of the needles after the first, in order
  boost::asio::steady_timer timer_;
};

}  // namespace

int replay_live(const ReplayOptions& options) {
  return LiveReplay(options, load_motion(options.trajectory, ReplayedModel::kDaemons)).run();
}

}  // namespace brachy
