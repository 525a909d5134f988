// SIGHUP: a running brachyd reads its scene file again, and clients stay connected.
#include <csignal>

#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"
#include "tests/apps/service/notify_socket.h"

namespace brachy {
namespace {

using namespace test;

struct BrachydReload : ::testing::Test {
  TempFolder folder;
  std::string scene = folder.write("scene.toml", text("psi31", 12));

  static std::string text(const std::string& kernel, double support_mm, const std::string& more = "") {
    return small_scene(more + "[model]\nkernel = \"" + kernel +
                       "\"\nsupport_radius_mm = " + std::to_string(support_mm) + "\n");
  }
  /// Replaces the file, and sends SIGHUP.
  void rewrite(RunningBrachyd& daemon, const std::string& what) {
    folder.write("scene.toml", what);
    daemon.process.send_signal(SIGHUP);
  }
  /// Whether such a STATE arrives: an older one may still be in transit.
  static bool comes_to(Peer& peer, const std::string& kernel, double support_mm) {
    return peer.until([&] {
      if (peer.states.empty()) return false;
      const auto& controls = peer.states.back().controls;
      return controls.kernel == kernel && controls.support_radius_mm == support_mm;
    });
  }
};

TEST_F(BrachydReload, AGoodSceneIsTakenUpABadOneIsNotAndClientsStay) {
  NotifySocket manager(folder / "notify");
  RunningBrachyd daemon(scene, {}, {"/usr/bin/env", manager.variable()});
  ASSERT_TRUE(manager.hears("READY=1"));
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port));
  ASSERT_TRUE(viewer.until([&] { return !viewer.frames.empty(); }));
  const std::uint64_t tick = viewer.last().message.tick;

  rewrite(daemon, text("psi31", 8));
  ASSERT_TRUE(manager.hears("RELOADING=1"));
  ASSERT_TRUE(manager.hears("READY=1"));
  EXPECT_NE(manager.messages.back().find("scene read again: model.support_radius_mm"), std::string::npos);
  EXPECT_TRUE(comes_to(viewer, "psi31", 8));

  rewrite(daemon, text("psi31", -8));
  ASSERT_TRUE(manager.hears("RELOADING=1"));
  ASSERT_TRUE(manager.hears("READY=1"));
  const std::string& refused = manager.messages.back();
  EXPECT_NE(refused.find("the old scene stays in use: " + scene + ":8: "), std::string::npos) << refused;
  EXPECT_NE(refused.find("support_radius_mm"), std::string::npos) << refused;
  EXPECT_TRUE(daemon.process.says("the old scene stays in use: " + scene + ":8: "));
  EXPECT_TRUE(comes_to(viewer, "psi31", 8));

  // A valid file for which no simulator can be created.
  rewrite(daemon,
          text("fem", 8) + "[[region]]\nshape = \"mesh\"\nfile = \"none.stl\"\nshear_modulus_kpa = 9\n");
  ASSERT_TRUE(manager.hears("RELOADING=1"));
  ASSERT_TRUE(manager.hears("READY=1"));
  EXPECT_NE(manager.messages.back().find("none.stl"), std::string::npos) << manager.messages.back();
  EXPECT_TRUE(comes_to(viewer, "psi31", 8));

  rewrite(daemon, text("psi30", 8));
  ASSERT_TRUE(manager.hears("RELOADING=1"));
  ASSERT_TRUE(manager.hears("READY=1"));
  EXPECT_TRUE(comes_to(viewer, "psi30", 8));
  const std::size_t frames = viewer.frames.size();
  EXPECT_TRUE(viewer.until([&] { return viewer.frames.size() > frames; }));
  EXPECT_GT(viewer.last().message.tick, tick) << "time goes on";
  EXPECT_TRUE(viewer.closed.empty());
  daemon.process.send_signal(SIGTERM);
  EXPECT_TRUE(exited(daemon.process.wait(), 0));
}

TEST_F(BrachydReload, WhatTakesARestartIsNamedAndStaysAsItWas) {
  RunningBrachyd daemon(scene);
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port));
  rewrite(daemon, text("psi31", 8, "max_clients = 1\n[needle]\ncount = 2\n[rates]\nsnapshot_hz = 20\n"));
  ASSERT_TRUE(daemon.process.says(
      "scene read again: restart brachyd for needle.count, rates.snapshot_hz, server.max_clients"));
  ASSERT_TRUE(daemon.process.says("scene read again: model.support_radius_mm"));
  EXPECT_TRUE(comes_to(viewer, "psi31", 8));
  Peer second;
  EXPECT_TRUE(second.join(daemon.port)) << "there are still 64 places";
}

TEST_F(BrachydReload, ASessionThatIsRecordedStaysWhatItsFilesSay) {
  RunningBrachyd daemon(scene, {"--session", (folder / "session").string()});
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port));
  rewrite(daemon, text("psi31", 8));
  ASSERT_TRUE(daemon.process.says("the old scene stays in use: a session is being recorded"));
  EXPECT_TRUE(comes_to(viewer, "psi31", 12));
}

TEST_F(BrachydReload, WhileAModelIsMadeTheDaemonEndsAllTheSame) {
  // A stiffer part for finite elements: seconds of work.
  const std::string slow = text("fem", 12) +
                           "[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\nradius_mm = 10\n"
                           "shear_modulus_kpa = 20\n";
  RunningBrachyd daemon(scene);
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port));
  rewrite(daemon, slow);
  ASSERT_TRUE(viewer.until([&] {
    return viewer.refresh_state() && (viewer.states.back().controls.flags & net::kPreparesModel) != 0;
  }));
  daemon.process.send_signal(SIGTERM);
  const Ended ended = daemon.process.wait();
  EXPECT_TRUE(exited(ended, 0));
  EXPECT_FALSE(json_of(ended).is_discarded()) << ended.out;
  EXPECT_EQ(ended.err.find("scene read again: region"), std::string::npos) << "it waited for the model";
}

TEST_F(BrachydReload, SignalsThatComeTogetherEndItAllTheSame) {
  RunningBrachyd daemon(scene);
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port));
  for (int i = 0; i < 20; ++i) daemon.process.send_signal(SIGHUP);
  daemon.process.send_signal(SIGTERM);
  EXPECT_TRUE(exited(daemon.process.wait(), 0));
}

}  // namespace
}  // namespace brachy
