// Seeds over real sockets: dropped by a device's button, sent to viewers with their dose.
#include <gtest/gtest.h>

#include "tests/apps/applicator.h"
#include "tests/apps/running_daemon.h"

namespace brachy {
namespace {

using namespace test;

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

TEST(DaemonSeeds, OneThatIsLostInFrontOfTheTemplateIsTold) {
  RunningDaemon daemon(small());
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  ASSERT_TRUE(device.peer.show(tip_at(8, -4, -61)));
  device.peer.client.press(true);
  EXPECT_TRUE(device.peer.until([&] {
    return std::ranges::any_of(device.peer.events, [](const net::EventMessage& e) {
      return e.kind == net::EventKind::kSeedLost && e.text.find("the seed is lost") != std::string::npos;
    });
  }));
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

// The button in the recording's columns and in the frames' section is the one that the simulation used.
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

}  // namespace
}  // namespace brachy
