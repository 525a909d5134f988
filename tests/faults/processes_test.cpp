// The programs themselves: stopped, without descriptors, and under a wall clock that jumps.
#include <dirent.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "haptics/trajectory/needle_trajectories.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"
#include "tests/net/igtl/igtl_peer.h"

namespace brachy {
namespace {

using namespace brachy::test;

struct ProcessesTest : ::testing::Test {
  const TempFolder folder;
  /// A small scene whose timeouts are short.
  std::string scene =
      folder.write("scene.toml", small_scene("silence_timeout_ms = 2000\nstall_timeout_ms = 2000\n"));
  std::string insertion = folder.write("insertion.csv", short_insertion(3));
};

bool sees(Peer& peer, const std::function<bool(const net::StateMessage&)>& condition) {
  return peer.until([&] { return !peer.states.empty() && condition(peer.states.back()); });
}

TEST_F(ProcessesTest, AStoppedViewerIsClosedAndTheOthersAreServed) {
  RunningBrachyd brachyd(scene, {"--trajectory", insertion, "--play"});
  Peer peer;
  ASSERT_TRUE(peer.join(brachyd.port));
  ChildProcess watch(brachy_line({"watch", "--connect", brachyd.address, "--duration", "600"}));
  ASSERT_TRUE(sees(peer, [](const auto& state) { return state.viewers == 2; }));
  watch.send_signal(SIGSTOP);
  ASSERT_TRUE(sees(peer, [](const auto& state) { return state.viewers == 1; }));
  const std::size_t frames = peer.frames.size();
  ASSERT_TRUE(peer.until([&] { return peer.frames.size() > frames + 10; }));
  EXPECT_TRUE(peer.closed.empty());
  watch.send_signal(SIGCONT);
  const Ended ended = watch.wait();
  EXPECT_TRUE(exited(ended, 1));
  EXPECT_FALSE(ended.err.empty()) << "it says what became of it";
}

TEST_F(ProcessesTest, AStoppedDeviceLosesItsNeedleToTheNext) {
  RunningBrachyd brachyd(scene);
  Peer peer;
  ASSERT_TRUE(peer.join(brachyd.port));
  ChildProcess replay(brachy_line({"replay", insertion, "--connect", brachyd.address, "--loop"}));
  ASSERT_TRUE(sees(peer, [](const auto& state) { return state.device_holder.starts_with("brachy replay"); }));
  replay.send_signal(SIGSTOP);
  ASSERT_TRUE(sees(peer, [](const auto& state) { return state.device_holder.empty(); }));
  Peer next(net::Role::kDevice, 0, false, "next");
  ASSERT_TRUE(next.join(brachyd.port));
  ASSERT_TRUE(sees(peer, [](const auto& state) { return state.device_holder.starts_with("next"); }));
  replay.send_signal(SIGCONT);
  const Ended ended = replay.wait();
  EXPECT_TRUE(exited(ended, 1));
  EXPECT_NE(ended.err.find("sent nothing for"), std::string::npos) << ended.err;
  EXPECT_TRUE(next.closed.empty());
}

/// 'T': stopped.
char state_of(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string number, name;
  char state = 0;
  file >> number >> name >> state;
  return state;
}

// How many deadlines it misses, and that it makes up for none: DeformationLoop's tests, and the case stop of
// scripts/campaigns/faults.sh in real time.
TEST_F(ProcessesTest, AStoppedServerKeepsItsClients) {
  const std::string patient = folder.write("patient.toml", small_scene());
  RunningBrachyd brachyd(patient);
  Peer viewer, device(net::Role::kDevice, 0, false, "device");
  ASSERT_TRUE(viewer.join(brachyd.port));
  ASSERT_TRUE(device.join(brachyd.port));
  viewer.stand_beside(device);
  ASSERT_TRUE(viewer.until([&] { return viewer.frames.size() > 5; }));
  brachyd.process.send_signal(SIGSTOP);
  ASSERT_TRUE(viewer.until([&] { return state_of(brachyd.process.pid()) == 'T'; }));
  const std::size_t received = viewer.frames.size(), states = viewer.states.size();
  viewer.client.request_state();
  brachyd.process.send_signal(SIGCONT);
  ASSERT_TRUE(
      viewer.until([&] { return viewer.frames.size() > received + 5 && viewer.states.size() > states; }));
  EXPECT_TRUE(viewer.closed.empty());
  EXPECT_TRUE(device.closed.empty());
  for (std::size_t i = 1; i < viewer.frames.size(); ++i) {
    const auto &last = viewer.frames[i - 1].message, &next = viewer.frames[i].message;
    EXPECT_GT(next.tick, last.tick);
    EXPECT_GE(next.overruns, last.overruns);
  }
}

std::size_t descriptors_of(pid_t pid) {
  const std::filesystem::directory_iterator all("/proc/" + std::to_string(pid) + "/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

TEST_F(ProcessesTest, WithoutDescriptorsTheDaemonServesWhomItHasAndAcceptsOnceThereAreSome) {
  RunningBrachyd brachyd(scene);
  Peer before;
  ASSERT_TRUE(before.join(brachyd.port));
  rlimit limit{};
  ASSERT_EQ(prlimit(brachyd.process.pid(), RLIMIT_NOFILE, nullptr, &limit), 0);
  rlimit none_left{descriptors_of(brachyd.process.pid()), limit.rlim_max};
  ASSERT_EQ(prlimit(brachyd.process.pid(), RLIMIT_NOFILE, &none_left, nullptr), 0);
  Peer waiting;
  waiting.connect(brachyd.port);
  ASSERT_TRUE(brachyd.process.says("cannot accept a connection"));
  const std::size_t frames = before.frames.size();
  ASSERT_TRUE(before.until([&] { return before.frames.size() > frames + 5; }));
  EXPECT_FALSE(waiting.welcomed);
  ASSERT_EQ(prlimit(brachyd.process.pid(), RLIMIT_NOFILE, &limit, nullptr), 0);
  EXPECT_TRUE(waiting.until([&] { return waiting.welcomed; }));
  EXPECT_TRUE(before.closed.empty());
  brachyd.process.send_signal(SIGTERM);
  const Ended ended = brachyd.process.wait();
  EXPECT_TRUE(exited(ended, 0));
  EXPECT_EQ(ended.err.find("cannot accept"), ended.err.rfind("cannot accept")) << "said once\n" << ended.err;
}

std::string faketime_library() {
  for (const char* file : {"/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1",
                           "/usr/lib/aarch64-linux-gnu/faketime/libfaketimeMT.so.1"})
    if (std::filesystem::exists(file)) return file;
  return {};
}

// An hour forward, then two back: stamps of the wall clock follow it, nothing else is affected.
TEST_F(ProcessesTest, AWallClockThatJumpsMovesStampsAndNothingElse) {
  const std::string library = faketime_library();
  if (library.empty()) GTEST_SKIP() << "faketime is not installed: scripts/setup.sh --all";
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer's library must be loaded first";
#endif
  const std::string clock = folder.write("clock", "+0");
  const std::string session = (folder / "session").string();
  RunningBrachyd brachyd(scene,
                         {"--trajectory", insertion, "--play", "--igtl-port", "0", "--session", session},
                         {"/usr/bin/env", "LD_PRELOAD=" + library, "FAKETIME_DONT_FAKE_MONOTONIC=1",
                          "FAKETIME_NO_CACHE=1", "FAKETIME_TIMESTAMP_FILE=" + clock});
  const auto line = brachyd.process.read_line();
  ASSERT_TRUE(line && line->starts_with("{\"igtl_on\":")) << line.value_or("none");
  Peer viewer;
  ASSERT_TRUE(viewer.join(brachyd.port));
  boost::asio::io_context io;
  net::igtl::test::IgtlPeer slicer(io,
                                   static_cast<std::uint16_t>(std::stoi(line->substr(line->rfind(':') + 1))));
  slicer.send_query("GET_STATUS");
  const auto ahead_s = [&] {  // of the newest stamp, against our clock; NaN: none yet
    slicer.take();
    if (slicer.count("TRANSFORM") == 0) return std::nan("");
    const std::int64_t stamp_ns = net::igtl::to_ns(slicer.last("TRANSFORM").header.timestamp);
    return 1e-9 * static_cast<double>(stamp_ns - net::real_clock().utc_ns());
  };
  for (const double offset_s : {0.0, 3600.0, -3600.0, 0.0}) {
    folder.write("clock.new", (offset_s < 0 ? "" : "+") + std::to_string(static_cast<int>(offset_s)));
    std::filesystem::rename(folder / "clock.new", clock);
    EXPECT_TRUE(viewer.until([&] { return std::abs(ahead_s() - offset_s) < 60; }))
        << offset_s << ", " << ahead_s();
    const std::size_t frames = viewer.frames.size();
    EXPECT_TRUE(viewer.until([&] { return viewer.frames.size() > frames + 15; }));
  }
  EXPECT_TRUE(viewer.closed.empty());
  EXPECT_FALSE(slicer.is_ended());
  for (std::size_t i = 1; i < viewer.frames.size(); ++i) {
    const auto &last = viewer.frames[i - 1].message, &next = viewer.frames[i].message;
    EXPECT_GT(next.tick, last.tick);
    EXPECT_LT(next.publish_ns - last.publish_ns, 60'000'000'000);
  }
  brachyd.process.send_signal(SIGTERM);
  EXPECT_TRUE(exited(brachyd.process.wait(), 0));
  const auto poses = load_trajectories(folder / "session/poses.csv");  // refuses times that do not increase
  EXPECT_LT(poses.end_s(), 60);
}

}  // namespace
}  // namespace brachy
