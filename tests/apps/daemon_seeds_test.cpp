// Seeds over real sockets: dropped by a device's button, told to viewers with their dose, kept through a kill.
#include <gtest/gtest.h>

#include <csignal>

#include "core/seeds/seed_file.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"
#include "tests/apps/running_daemon.h"

namespace brachy {
namespace {

using namespace test;

/// A device beside whose poses the button is pressed.
class Applicator {
 public:
  explicit Applicator(const std::string& name = "applicator")
      : peer(net::Role::kDevice, net::kSubscribePoseHistory, false, name) {}

  bool join(std::uint16_t port) { return peer.join(port); }
  bool go(const std::vector<RigidTransform>& way) {
    return std::all_of(way.begin(), way.end(), [&](const RigidTransform& to) { return peer.show(to); });
  }
  const std::vector<Seed>& seeds() const { return peer.client.mesh().seeds(); }
  /// Presses and lets go, until one more seed is seen.
  bool drop() {
    const std::size_t before = seeds().size();
    peer.client.press(true);
    peer.client.press(false);
    return peer.until([&] { return seeds().size() > before; });
  }
  bool has_event(const std::string& part) const {
    return std::ranges::any_of(peer.events, [&](const net::EventMessage& e) {
      return e.kind == net::EventKind::kSeed && e.text.find(part) != std::string::npos;
    });
  }
  Peer peer;
};

TEST(DaemonSeeds, APressOfTheButtonDropsOneThatAllSeeWithItsDose) {
  RunningDaemon daemon(small());
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port()));
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  ASSERT_TRUE(device.go(way_in()));
  ASSERT_TRUE(device.drop());
  const Seed seed = device.seeds().front();
  EXPECT_EQ(seed.id, 1u);
  EXPECT_EQ(seed.dropped, way_in().back().p);
  ASSERT_TRUE(viewer.until([&] { return viewer.client.mesh().seeds().size() == 1; }));
  ASSERT_TRUE(viewer.until([&] { return !viewer.doses.empty(); }));
  EXPECT_EQ(viewer.doses.back().seeds, 1u);
  EXPECT_EQ(viewer.doses.back().air_kerma_strength_u, 0.5);
  ASSERT_EQ(viewer.doses.back().structures.size(), 3u);
  EXPECT_EQ(viewer.doses.back().structures[0].name, "prostate");
  EXPECT_GT(viewer.doses.back().structures[0].mean_gy, 0.5);
  EXPECT_TRUE(device.peer.until([&] { return device.has_event("seed 1 dropped"); }));

  ASSERT_TRUE(device.go(way_out()));
  ASSERT_TRUE(device.peer.until([&] { return device.peer.last().message.moved_vertices == 0; }));
  EXPECT_EQ(device.seeds().front().position, seed.rest);
  const DaemonSummary& summary = daemon.stop();
  EXPECT_EQ(summary.seeds_dropped, 1u);
  EXPECT_EQ(summary.drops_refused, 0u);
  EXPECT_EQ(summary.dose.drop_to_dvh_ns.count(), 1u);
}

TEST(DaemonSeeds, OneThatCannotFallIsToldAndStaysInTheNeedle) {
  RunningDaemon daemon(small());
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  ASSERT_TRUE(device.peer.show(tip_at(8, -4, -60)));
  device.peer.client.press(true);
  EXPECT_TRUE(device.peer.until([&] { return device.has_event("the tip is not in the tissue"); }));
  EXPECT_TRUE(device.seeds().empty());
  EXPECT_EQ(daemon.stop().drops_refused, 1u);
}

TEST(DaemonSeeds, EachOfManyQuickPressesDropsOne) {
  RunningDaemon daemon(small());
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  ASSERT_TRUE(device.go(way_in()));
  for (int i = 0; i < 10; ++i) {
    device.peer.client.press(true);
    device.peer.client.press(false);
  }
  EXPECT_TRUE(device.peer.until([&] { return device.seeds().size() == 10; }));
  EXPECT_EQ(daemon.stop().seeds_dropped, 10u);
}

// What the recording's columns and the frames' section say of the button is what the simulation used.
TEST(DaemonSeeds, TheButtonIsInThePoseHistory) {
  RunningDaemon daemon(small());
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  ASSERT_TRUE(device.go(way_in()));
  ASSERT_TRUE(device.drop());
  std::vector<std::uint64_t> held;
  for (const Peer::Frame& frame : device.peer.frames)
    for (const TickPose& pose : frame.message.pose_history)
      if (pose.button) held.push_back(pose.tick);
  ASSERT_EQ(held.size(), 1u);
  EXPECT_EQ(held[0], device.seeds().front().tick);
}

// Whoever was told of a seed finds it again: order, count and places, however the daemon ended.
TEST(DaemonSeeds, SurviveKillMinusNine) {
  const TempFolder folder;
  const std::string scene = folder.write("scene.toml", small_scene());
  const std::string session = (folder / "session").string();
  std::vector<Seed> told;
  for (int run = 0; run < 3; ++run) {
    RunningBrachyd brachyd(scene, {"--session", session});
    Applicator device;
    ASSERT_TRUE(device.join(brachyd.port));
    ASSERT_TRUE(device.peer.until([&] { return !device.peer.frames.empty(); }));
    ASSERT_GE(device.seeds().size(), told.size());
    for (std::size_t i = 0; i < told.size(); ++i) {
      EXPECT_EQ(device.seeds()[i].id, told[i].id);
      EXPECT_EQ(device.seeds()[i].rest, told[i].rest);
      EXPECT_EQ(device.seeds()[i].dropped, told[i].dropped);
    }
    ASSERT_TRUE(device.go(way_in()));
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(device.drop());
    device.peer.client.press(true);  // and one that nobody waits for
    device.peer.client.press(false);
    device.peer.poll();
    told = device.seeds();
    brachyd.process.send_signal(SIGKILL);
    EXPECT_EQ(brachyd.process.wait().signal, SIGKILL);
    const std::vector<Seed> kept = load_seeds(session + "/seeds.csv");
    ASSERT_GE(kept.size(), told.size());
    EXPECT_LE(kept.size(), told.size() + 1);
  }
  EXPECT_GE(told.size(), 9u);
}

}  // namespace
}  // namespace brachy
