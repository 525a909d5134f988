// For scripts/campaigns/faults.sh: many well-behaved viewers in one process, which measure how evenly they are served,
// and peers that are slow, half-open, or flood the daemon with poses. Prints one line of JSON at the end.
#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <CLI/CLI.hpp>
#include <csignal>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "net/base/clock.h"
#include "net/client/client.h"
#include "tests/faults/fault_proxy.h"

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;

struct CrowdOptions {
  std::uint16_t port = 0;
  std::size_t viewers = 20;
  double seconds = 10;
  bool surface = false;
  bool images = false;
  std::vector<std::string> bad;  // slow, half-open-viewer, half-open-device, flood
};

/// A well-behaved viewer, and the gaps between its frames.
class GoodViewer {
 public:
  GoodViewer(boost::asio::io_context& io, const CrowdOptions& options)
      : client_(io, client_options(options), handlers()) {}
  void connect(std::uint16_t port) { client_.connect("127.0.0.1", port); }

  bool has_settled() const { return last_frame_ns_ != 0 || !closed_.empty(); }
  void begin() { gaps_ms_.clear(); }

  const std::vector<double>& gaps_ms() const { return gaps_ms_; }
  bool is_served() const { return last_frame_ns_ != 0 && closed_.empty(); }
  bool was_told_busy() const { return was_told_busy_; }
  const std::string& closed() const { return closed_; }
  const net::FrameMessage& frame() const { return frame_; }
  const net::StateMessage& state() const { return state_; }
  std::size_t seeds() const { return client_.mesh().seeds().size(); }
  std::uint64_t images() const { return images_; }
  std::uint64_t snapshots_missed() const { return client_.snapshots_missed(); }

 private:
  static net::ClientOptions client_options(const CrowdOptions& options) {
    net::ClientOptions c;
    c.name = "good";
    if (options.surface) c.subscription = net::kSubscribeSurface;
    if (options.images) c.subscription |= net::kSubscribeUltrasound;
    return c;
  }
  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    h.on_frame = [this](const net::FrameMessage& frame) {
      const std::int64_t now_ns = monotonic_ns();
      if (last_frame_ns_ != 0) gaps_ms_.push_back(1e-6 * static_cast<double>(now_ns - last_frame_ns_));
      last_frame_ns_ = now_ns;
      frame_.tick = frame.tick;
      frame_.overruns = frame.overruns;
      frame_.sim_time_s = frame.sim_time_s;
    };
    h.on_state = [this](const net::StateMessage& state) { state_ = state; };
    h.on_image = [this](const net::ImageMessage&) { ++images_; };
    h.on_error = [this](const net::ErrorMessage& e) { was_told_busy_ |= e.code == net::ErrorCode::kBusy; };
    h.on_closed = [this](const std::string& reason) { closed_ = reason; };
    return h;
  }

  std::vector<double> gaps_ms_;
  std::int64_t last_frame_ns_ = 0;  // 0: none yet
  std::uint64_t images_ = 0;
  net::FrameMessage frame_;  // tick and overruns of the newest
  net::StateMessage state_;
  std::string closed_;
  bool was_told_busy_ = false;
  net::Client client_;
};

/// A peer behind a proxy that disturbs its connection, or one that sends 10,000 poses a second.
class BadPeer {
 public:
  BadPeer(boost::asio::io_context& io, const std::string& kind, std::uint16_t port)
      : kind_(kind),
        proxy_(io, net::real_clock(), port),
        timer_(io),
        client_(io, client_options(kind), handlers()) {
    proxy_.next.receive_buffer = 4096;
    if (kind == "slow") proxy_.next.down = test::Way::at_rate(1000);
  }
  void connect() { client_.connect("127.0.0.1", proxy_.port()); }
  bool has_settled() const { return welcomed_ || kind_ == "slow"; }  // for that one WELCOME takes its time

  void begin() {
    begin_ns_ = monotonic_ns();
    if (kind_.starts_with("half-open")) proxy_.cut(0, test::Cut::kSilence);
    if (kind_ == "flood") flood();
  }
  OrderedJson to_json() const {
    return {{"kind", kind_},
            {"began_ns", begin_ns_},
            {"bytes_read", proxy_.passed_down(0)},
            {"poses_sent", client_.poses_sent()},
            {"errors", errors_},
            {"closed", closed_}};
  }

 private:
  static net::ClientOptions client_options(const std::string& kind) {
    net::ClientOptions c;
    c.name = kind;
    if (kind == "half-open-device" || kind == "flood") c.role = net::Role::kDevice;
    if (kind == "flood") c.subscription = net::kSubscribeNoMesh;
    c.silence_timeout = std::chrono::hours(1);
    c.max_queued_poses = 10'000;
    return c;
  }
  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    h.on_welcome = [this](const net::WelcomeMessage&) { welcomed_ = true; };
    h.on_error = [this](const net::ErrorMessage&) { ++errors_; };
    h.on_closed = [this](const std::string& reason) { closed_ = reason; };
    return h;
  }
  // Ten poses every millisecond; those of one that is missed too.
  void flood() {
    if (!client_.is_open()) return;
    const std::uint64_t due = static_cast<std::uint64_t>(monotonic_ns() - begin_ns_) / 100'000;
    for (; flooded_ < due; ++flooded_) client_.send_pose(RigidTransform{}, monotonic_ns());
    timer_.expires_after(std::chrono::milliseconds(1));
    timer_.async_wait([this](const auto& error) {
      if (!error) flood();
    });
  }

  const std::string kind_;
  test::FaultProxy proxy_;
  boost::asio::steady_timer timer_;
  std::int64_t begin_ns_ = 0;
  std::uint64_t flooded_ = 0, errors_ = 0;
  bool welcomed_ = false;
  std::string closed_;
  net::Client client_;
};

double quantile(std::vector<double>& values, double q) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

class Crowd {
 public:
  explicit Crowd(const CrowdOptions& options)
      : options_(options), timer_(io_), end_(io_), signals_(io_, SIGINT, SIGTERM) {}

  void run() {
    for (std::size_t i = 0; i < options_.viewers; ++i)
      good_.emplace_back(std::make_unique<GoodViewer>(io_, options_))->connect(options_.port);
    for (const std::string& kind : options_.bad)
      bad_.emplace_back(std::make_unique<BadPeer>(io_, kind, options_.port))->connect();
    signals_.async_wait([this](const auto& error, int) {
      if (!error) io_.stop();
    });
    await_all();
    io_.run();
    report();
  }

 private:
  // Measured from when every client has had a frame or was refused.
  void await_all() {
    const auto settled = [](const auto& peer) { return peer->has_settled(); };
    if (std::ranges::all_of(good_, settled) && std::ranges::all_of(bad_, settled)) return begin();
    timer_.expires_after(std::chrono::milliseconds(10));
    timer_.async_wait([this](const auto& error) {
      if (!error) await_all();
    });
  }
  void begin() {
    for (const auto& viewer : good_) viewer->begin();
    for (const auto& peer : bad_) peer->begin();
    if (!good_.empty()) {
      first_ = good_[0]->frame();
      first_control_overruns_ = good_[0]->state().control_overruns;
    }
    std::cout << "ready" << std::endl;
    end_.expires_after(std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * options_.seconds)));
    end_.async_wait([this](const auto& error) {
      if (!error) io_.stop();
    });
  }

  void report() const {
    OrderedJson json;
    std::vector<double> gaps;
    std::map<std::string, int> closed;
    std::size_t served = 0, busy = 0;
    std::uint64_t missed = 0, images = 0;
    for (const auto& viewer : good_) {
      gaps.insert(gaps.end(), viewer->gaps_ms().begin(), viewer->gaps_ms().end());
      served += viewer->is_served();
      busy += viewer->was_told_busy();
      missed += viewer->snapshots_missed();
      images += viewer->images();
      if (!viewer->closed().empty()) ++closed[viewer->closed()];
    }
    json["served"] = served;
    json["busy"] = busy;
    json["closed"] = closed;
    json["frames"] = gaps.size();
    json["snapshots_missed"] = missed;
    json["images"] = images;
    json["gap_ms"] = {
        {"p50", quantile(gaps, 0.5)}, {"p99", quantile(gaps, 0.99)}, {"max", quantile(gaps, 1)}};
    if (!good_.empty()) {
      const GoodViewer& witness = *good_[0];
      const std::uint64_t ticks = witness.frame().tick - first_.tick;
      const std::uint64_t overruns = witness.frame().overruns - first_.overruns;
      std::uint64_t refused = 0;
      for (const auto& r : witness.state().refusals) refused += r.count;
      json["ticks"] = ticks;
      json["overruns"] = overruns;
      json["control_overruns"] = witness.state().control_overruns - first_control_overruns_;
      json["last_tick"] = witness.frame().tick;
      json["seeds"] = witness.seeds();
      json["poses_accepted"] = witness.state().poses_accepted;
      json["poses_refused"] = refused;
    }
    json["bad"] = OrderedJson::array();
    for (const auto& peer : bad_) json["bad"].push_back(peer->to_json());
    std::cout << json.dump() << std::endl;
  }

  const CrowdOptions options_;
  boost::asio::io_context io_{1};
  boost::asio::steady_timer timer_, end_;
  boost::asio::signal_set signals_;
  std::vector<std::unique_ptr<GoodViewer>> good_;
  std::vector<std::unique_ptr<BadPeer>> bad_;
  net::FrameMessage first_;
  std::uint64_t first_control_overruns_ = 0;
};

}  // namespace
}  // namespace brachy

int main(int argc, char** argv) {
  brachy::CrowdOptions options;
  CLI::App app{"Good viewers and bad peers for scripts/campaigns/faults.sh"};
  app.add_option("--port", options.port, "of the daemon, on 127.0.0.1")->required();
  app.add_option("--viewers", options.viewers, "good ones");
  app.add_option("--seconds", options.seconds, "to measure, once all are there; SIGINT ends it sooner");
  app.add_flag("--surface", options.surface, "viewers of the surface alone");
  app.add_flag("--images", options.images, "viewers take ultrasound images, too");
  app.add_option("--bad", options.bad, "peers beside them")
      ->check(CLI::IsMember({"slow", "half-open-viewer", "half-open-device", "flood"}));
  CLI11_PARSE(app, argc, argv);
  try {
    brachy::Crowd(options).run();
  } catch (const std::exception& e) {
    std::cerr << "brachy_crowd: " << e.what() << "\n";
    return 1;
  }
  return 0;
}
