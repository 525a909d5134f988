// live_fuzzer PID NATIVE HTTP IGTL MESSAGES: sends a running brachyd that many mutated messages, over TCP, WebSocket
// and OpenIGTLink, while a well-behaved viewer and device are connected; quiet and fuzzed halves of equal length
// alternate. Judges memory, descriptors, missed ticks and the viewer's frames; exit code 1 if a limit is exceeded, 2
// for bad usage. scripts/campaigns/live_fuzz.sh runs it.
#include <signal.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <list>
#include <optional>

#include "net/base/clock.h"
#include "net/client/client.h"
#include "tests/fuzz/hostile_peer.h"

namespace brachy::fuzz {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kMessagesPerS = 1000;  // of mutated ones; as many again are not
constexpr std::size_t kPeers = 24;      // at a time
constexpr double kLeastHalfS = 2;
constexpr std::size_t kMostHalves = 10;     // quiet ones, and as many fuzzed
constexpr double kWarmUpShare = 0.2;        // of the messages, but
constexpr std::size_t kLeastWarmUp = 2000;  // until the allocator has what a busy moment takes

constexpr double kMostGrowthMb = 5;
// of fuzzing to judge ticks by: in fewer a handful of the machine's is half a percent
constexpr double kLeastSeconds = 50;
constexpr double kMostMoreMissed = 0.005;  // of all ticks

struct Process {
  pid_t pid;

  bool is_alive() const { return ::kill(pid, 0) == 0; }
  double resident_mb() const {
    std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
    double pages = 0, resident = 0;
    file >> pages >> resident;
    return resident * 4096 / 1e6;
  }
  std::size_t descriptors() const {
    std::error_code error;
    std::filesystem::directory_iterator entry("/proc/" + std::to_string(pid) + "/fd", error);
    return error ? 0 : static_cast<std::size_t>(std::distance(entry, {}));
  }
};

/// A viewer of all points and the device of needle 0, which moves a needle to and fro, 200 poses a second.
class GoodClients {
 public:
  GoodClients(boost::asio::io_context& io, std::uint16_t port)
      : timer_(io),
        viewer_(io, options(net::Role::kViewer), viewer_handlers()),
        device_(io, options(net::Role::kDevice), device_handlers()) {
    viewer_.connect("127.0.0.1", port);
    device_.connect("127.0.0.1", port);
    send_pose();
  }

  const std::string& failure() const { return failure_; }
  bool is_served() const { return viewer_.frames() > 0 && state_.poses_accepted > 0; }
  std::uint64_t frames() const { return viewer_.frames(); }
  std::uint64_t frames_missed() const { return viewer_.snapshots_missed(); }
  std::uint64_t poses_accepted() const { return state_.poses_accepted; }
  std::uint64_t overruns() const { return state_.overruns; }
  double deformation_hz() const { return deformation_hz_; }

 private:
  net::ClientOptions options(net::Role role) const {
    net::ClientOptions options;
    options.role = role;
    options.name = role == net::Role::kDevice ? "good device" : "good viewer";
    if (role == net::Role::kDevice) options.needle = 0, options.subscription = net::kSubscribeNoMesh;
    return options;
  }
  net::ClientHandlers viewer_handlers() {
    net::ClientHandlers handlers = device_handlers();
    handlers.on_welcome = [this](const net::WelcomeMessage& welcome) {
      deformation_hz_ = welcome.deformation_hz;
    };
    handlers.on_state = [this](const net::StateMessage& state) { state_ = state; };
    return handlers;
  }
  net::ClientHandlers device_handlers() {
    net::ClientHandlers handlers;
    handlers.on_closed = [this](const std::string& reason) { failure_ = reason; };
    return handlers;
  }
  void send_pose() {
    const double t_s = 1e-9 * static_cast<double>(monotonic_ns());
    RigidTransform X;
    X.p = {6, 2, -20 + 15 * std::sin(t_s)};
    device_.send_pose(X, monotonic_ns());
    timer_.expires_after(std::chrono::milliseconds(5));
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) send_pose();
    });
  }

  boost::asio::steady_timer timer_;
  net::Client viewer_, device_;
  net::StateMessage state_;  // the newest
  double deformation_hz_ = 200;
  std::string failure_;
};

/// Totals over all halves of a kind.
struct Tally {
  double seconds = 0;
  std::uint64_t missed = 0, frames = 0, frames_missed = 0;
  double missed_share(double hz) const { return static_cast<double>(missed) / (seconds * hz); }
  double gap_share() const {
    return static_cast<double>(frames_missed) /
           static_cast<double>(std::max<std::uint64_t>(1, frames + frames_missed));
  }
};

class Run {
 public:
  Run(Process brachyd, Doors doors, std::size_t messages)
      : brachyd_(brachyd), doors_(doors), messages_(messages), good_(io_, doors.native) {}

  int run() {
    if (!serve_until([&] { return good_.is_served(); }, 20)) return fail("the good clients are not served");
    serve_for(1);
    const std::size_t descriptors = brachyd_.descriptors();
    const auto share = static_cast<std::size_t>(kWarmUpShare * static_cast<double>(messages_));
    const std::size_t warm_up = std::min(messages_ / 2, std::max(share, kLeastWarmUp));
    std::printf("live fuzz: warm-up, %zu messages\n", warm_up);
    std::fflush(stdout);
    send(warm_up);
    crowd();
    settle(descriptors);
    const double resident_mb = brachyd_.resident_mb();

    Tally quiet, fuzzed;
    const double fuzzed_s = static_cast<double>(messages_ - warm_up) / kMessagesPerS;
    const auto halves =
        std::clamp(static_cast<std::size_t>(fuzzed_s / kLeastHalfS), std::size_t{1}, kMostHalves);
    for (std::size_t half = 1; half <= halves; ++half) {
      const std::size_t goal = warm_up + (messages_ - warm_up) * half / halves;
      const double half_s = measure(fuzzed, [&] { send(goal > sent_ ? goal - sent_ : 0); });
      measure(quiet, [&] { serve_for(half_s); });
      std::printf(
          "live fuzz: %zu of %zu messages, %zu connections; missed ticks quiet %.3f %%, fuzzed %.3f %%, "
          "%+.2f MB\n",
          sent_, messages_, connections_, 100 * quiet.missed_share(good_.deformation_hz()),
          100 * fuzzed.missed_share(good_.deformation_hz()), brachyd_.resident_mb() - resident_mb);
      std::fflush(stdout);
    }
    settle(descriptors);
    double from_mb = resident_mb;
    if (brachyd_.resident_mb() - from_mb >= kMostGrowthMb) {
      // A simulation that the allocator keeps after a reset is such a step, once; a leak grows again.
      from_mb = brachyd_.resident_mb();
      std::printf("live fuzz: %+.2f MB since warm-up; as many messages again show whether it is a leak\n",
                  from_mb - resident_mb);
      std::fflush(stdout);
      send(messages_ - warm_up);
      settle(descriptors);
    }
    return judge(quiet, fuzzed, descriptors, from_mb);
  }

 private:
  /// Serves the well-behaved clients for a turn.
  void serve() { io_.run_for(std::chrono::milliseconds(1)); }
  template <class Condition>
  bool serve_until(Condition&& condition, double seconds) {
    const auto end = Clock::now() + std::chrono::duration<double>(seconds);
    while (!condition() && Clock::now() < end && good_.failure().empty()) serve();
    return condition();
  }
  void serve_for(double seconds) {
    serve_until([] { return false; }, seconds);
  }

  /// Mutated messages at kMessagesPerS.
  void send(std::size_t count) {
    const std::size_t goal = sent_ + count, from = sent_;
    const auto begin = Clock::now();
    while (sent_ < goal && brachyd_.is_alive() && good_.failure().empty()) {
      serve();
      const double passed_s = std::chrono::duration<double>(Clock::now() - begin).count();
      const auto due = std::min(goal, from + static_cast<std::size_t>(passed_s * kMessagesPerS));
      if (sent_ < due && peers_.size() < kPeers) {
        peers_.emplace_back(io_, make_conversation(doors_, random_), random_);
        ++connections_;
      }
      peers_.remove_if([this](HostilePeer& peer) {
        const std::size_t before = peer.mutated_sent();
        const bool goes_on = peer.step();
        sent_ += peer.mutated_sent() - before;
        return !goes_on;
      });
    }
  }

  /// As many clients as are ever connected at once, each with a frame that it does not read: the allocator's peak,
  /// which the daemon may keep or return whenever as many meet again.
  void crowd() {
    peers_.clear();
    for (std::size_t i = 0; i < kPeers; ++i) {
      peers_.emplace_back(io_, greedy_conversation(doors_), random_).be_deaf();
      peers_.back().step();
      serve_for(0.05);
    }
    insert_other_needle();
    reset();
  }

  /// Moves needle 1 as hostile devices do, because a simulator touches some of its memory only then.
  void insert_other_needle() {
    net::ClientOptions options;
    options.role = net::Role::kDevice;
    options.name = "warm-up";
    options.needle = 1;
    options.subscription = net::kSubscribeNoMesh;
    net::Client device(io_, options, {});
    device.connect("127.0.0.1", doors_.native);
    for (double x = 0; x < 20; x += 5)
      for (double z = -60; z < 30; z += 0.5) {
        RigidTransform X;
        X.p = {x, 0, z};
        device.send_pose(X, monotonic_ns());
        serve_for(0.005);
      }
  }

  /// Starts another simulator beside the one in use, as a mutated CONTROL may.
  void reset() {
    net::ClientOptions options;
    options.role = net::Role::kOperator;
    options.name = "warm-up";
    options.subscription = net::kSubscribeNoMesh;
    net::Client desk(io_, options, {});
    desk.connect("127.0.0.1", doors_.native);
    for (int times = 0; times < 2; ++times) {
      desk.control({net::ControlAction::kReset, false, 0, ""});
      serve_for(1.5);
    }
  }

  /// Waits until all connections are closed and released by the daemon.
  void settle(std::size_t descriptors) {
    peers_.clear();
    serve_until([&] { return brachyd_.descriptors() <= descriptors; }, 15);
    serve_for(1);
  }

  /// Adds the ticks and frames during `act` to the tally; returns its duration, s.
  template <class Act>
  double measure(Tally& tally, Act&& act) {
    constexpr double kStateS = 0.6;  // a STATE comes every 0.5 s
    serve_for(kStateS);
    const auto begin = Clock::now();
    const auto passed_s = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
    const std::uint64_t missed = good_.overruns(), frames = good_.frames(), gaps = good_.frames_missed();
    act();
    const double act_s = passed_s();
    serve_for(kStateS);
    tally.seconds += passed_s();
    tally.missed += good_.overruns() - missed;
    tally.frames += good_.frames() - frames;
    tally.frames_missed += good_.frames_missed() - gaps;
    return act_s;
  }

  int judge(const Tally& quiet, const Tally& fuzzed, std::size_t descriptors, double from_mb) {
    const std::uint64_t frames = good_.frames(), poses = good_.poses_accepted();
    const bool is_serving =
        brachyd_.is_alive() && good_.failure().empty() &&
        serve_until([&] { return good_.frames() > frames + 3 && good_.poses_accepted() > poses; }, 5);
    const double growth_mb = brachyd_.resident_mb() - from_mb;
    const auto leaked = static_cast<long>(brachyd_.descriptors()) - static_cast<long>(descriptors);
    const double hz = good_.deformation_hz();
    const double more_missed = fuzzed.missed_share(hz) - quiet.missed_share(hz);
    const double more_gaps = fuzzed.gap_share() - quiet.gap_share();
    std::printf("%-34s %10s %10s %s\n", "", "quiet", "fuzzed", "");
    std::printf(
        "%-34s %10.3f %10.3f %s\n", "ticks missed, %", 100 * quiet.missed_share(hz),
        100 * fuzzed.missed_share(hz),
        fuzzed.seconds < kLeastSeconds ? "too few to judge" : verdict(more_missed <= kMostMoreMissed));
    std::printf("%-34s %10.3f %10.3f %s\n", "good viewer's sequence gaps, %", 100 * quiet.gap_share(),
                100 * fuzzed.gap_share(), verdict(more_gaps <= kMostMoreMissed));
    std::printf("%-34s %10s %10.2f %s\n", "growth of resident memory, MB", "", growth_mb,
                verdict(growth_mb < kMostGrowthMb));
    std::printf("%-34s %10s %10ld %s\n", "descriptors leaked", "", leaked, verdict(leaked <= 0));
    std::printf("%-34s %10s %10s %s\n", "alive, and serving", "", is_serving ? "yes" : "no",
                verdict(is_serving));
    if (!good_.failure().empty()) std::printf("  a good client was ended: %s\n", good_.failure().c_str());
    return is_good_ ? 0 : 1;
  }
  const char* verdict(bool is_good) {
    is_good_ = is_good_ && is_good;
    return is_good ? "" : "MISSED";
  }
  int fail(const char* what) {
    std::fprintf(stderr, "live fuzz: %s%s%s\n", what, good_.failure().empty() ? "" : ": ",
                 good_.failure().c_str());
    return 1;
  }

  const Process brachyd_;
  const Doors doors_;
  const std::size_t messages_;
  boost::asio::io_context io_;
  GoodClients good_;
  std::mt19937 random_{20261122};
  std::list<HostilePeer> peers_;
  std::size_t sent_ = 0, connections_ = 0;
  bool is_good_ = true;
};

}  // namespace
}  // namespace brachy::fuzz

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fprintf(stderr, "usage: live_fuzzer PID NATIVE_PORT HTTP_PORT IGTL_PORT MESSAGES\n");
    return 2;
  }
  const auto number = [&](int i) { return std::strtoul(argv[i], nullptr, 10); };
  const auto port = [&](int i) { return static_cast<std::uint16_t>(number(i)); };
  using namespace brachy::fuzz;
  return Run({static_cast<pid_t>(number(1))}, {port(2), port(3), port(4)}, number(5)).run();
}
