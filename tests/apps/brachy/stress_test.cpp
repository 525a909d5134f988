// The short form of scripts/campaigns/stress.sh: its trajectory through a daemon over sockets. The assertions hold
// however busy the machine is; the script checks deadlines.
#include <gtest/gtest.h>

#include <csignal>

#include "apps/reports/certificate_report.h"
#include "test_paths.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"

namespace brachy {
namespace {

using namespace test;

struct Stress : ::testing::Test {
  // Five seconds' motion in one: at 1 kHz and five times the speed a tick sees what it sees at 200 Hz.
  static constexpr const char* kSpeed = "5";
  TempFolder folder;
  std::string scene =
      folder.write("scene.toml", small_scene("[anchors]\nclearance_mm = 0\n"
                                             "[rates]\ndeformation_hz = 1000\nsnapshot_hz = 120\n"
                                             "[device]\nstale_pose_ms = 60000\n"));

  std::string trajectory() {
    const std::string surface = (folder / "surface.ply").string();
    const Ended inspected = run_brachy({"inspect", scene, "--out", surface, "--json"});
    EXPECT_TRUE(exited(inspected, 0));
    const Ended written =
        run_process({"/usr/bin/python3", BRACHY_SOURCE_DIR "/scripts/campaigns/stress.py", "trajectory", "5",
                     folder.write("inspect.json", inspected.out), surface});
    EXPECT_TRUE(exited(written, 0));
    return folder.write("stress.csv", written.out);
  }
};

void expect_certified_or_flagged(const nlohmann::json& json, const std::string& counted,
                                 const std::string& total) {
  EXPECT_EQ(json.at(counted + "_injective").get<int>() + json.at(counted + "_folded").get<int>() +
                json.at(counted + "_unknown").get<int>(),
            json.at(total));
  EXPECT_EQ(json.at(counted + "_unflagged"), 0);
  EXPECT_EQ(json.at("nonfinite"), 0);
}

TEST_F(Stress, TheTrajectoryGoesWhereMethodsFailAndEveryTickIsCertifiedOrFlagged) {
  const auto json = json_of(
      run_brachy({"replay", trajectory(), "--offline", "--config", scene, "--speed", kSpeed, "--json"}));
  ASSERT_FALSE(json.is_discarded());
  expect_certified_or_flagged(json, "ticks", "ticks");
  EXPECT_EQ(json.at("reinitialized"), true);
  EXPECT_EQ(json.at("saturated"), true);
  EXPECT_GE(json.at("punctures").get<int>(), 2);
  EXPECT_GT(json.at("max_depth_mm").get<double>(), 30);
  EXPECT_GT(json.at("ticks_in_contact").get<int>(), 500);
  // The tip stood on an anchor: the same landmark twice, which no solve takes as it is.
  EXPECT_GT(json.at("ticks_solve_failed").get<int>() + json.at("ticks_merged").get<int>() +
                json.at("ticks_dropped").get<int>(),
            0);
  EXPECT_EQ(json.at("contact"), "withdrawn");
}

TEST_F(Stress, EveryTickAndFrameOfADaemonIsCertifiedOrFlagged) {
  const std::string poses = trajectory();
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  ChildProcess watch(brachy_line({"watch", "--connect", daemon.address, "--json"}));
  Peer peer;
  ASSERT_TRUE(peer.join(daemon.port));
  ASSERT_TRUE(peer.until([&] { return peer.refresh_state() && peer.states.back().viewers == 2; }));
  const Ended replayed = run_brachy(
      {"replay", poses, "--connect", daemon.address, "--speed", kSpeed, "--rate-hz", "1000", "--json"});
  ASSERT_TRUE(
      peer.until([&] { return !peer.frames.empty() && peer.needle().contact == ContactState::kWithdrawn; }));
  EXPECT_EQ(peer.last().message.moved_vertices, 0u);
  watch.send_signal(SIGINT);
  const Ended watched = watch.wait();
  daemon.process.send_signal(SIGTERM);
  const Ended ended = daemon.process.wait();
  ASSERT_TRUE(exited(replayed, 0));
  ASSERT_TRUE(exited(watched, 0));
  ASSERT_TRUE(exited(ended, 0));

  const auto frames = json_of(watched), ticks = json_of(ended);
  ASSERT_FALSE(frames.is_discarded() || ticks.is_discarded());
  expect_certified_or_flagged(frames, "frames", "snapshots");
  expect_certified_or_flagged(ticks, "ticks", "ticks");
  EXPECT_GT(ticks.at("poses_accepted").get<int>(), 0);
  EXPECT_GT(frames.at("snapshots").get<int>(), 0);
}

/// The output of `stress.py judge` for a run of 60 s.
struct Judge : ::testing::Test {
  Judge() {
    ticks.injective = 11'990;
    ticks.folded = 10;
    frames.injective = 1799;
    frames.unknown = 1;
  }
  Ended verdict() {
    add_to_json(daemon, "ticks", ticks);
    add_to_json(watch, "frames", frames);
    const auto write = [&](const char* name, const nlohmann::ordered_json& json) {
      return folder.write(name, "{\"listening_on\":\"127.0.0.1:1\"}\n" + json.dump() + "\n");
    };
    return run_process({"/usr/bin/python3", BRACHY_SOURCE_DIR "/scripts/campaigns/stress.py", "judge", "60",
                        write("daemon.json", daemon), write("watch.json", watch),
                        write("replay.json", replay)});
  }
  ::testing::AssertionResult fails_for(const std::string& reason) {
    const Ended ended = verdict();
    if (const auto code = exited(ended, 1); !code) return code;
    if (ended.out.find("stress: FAILED: " + reason) == std::string::npos)
      return ::testing::AssertionFailure() << ended.out;
    return ::testing::AssertionSuccess();
  }

  TempFolder folder;
  CertificateTally ticks, frames;
  nlohmann::ordered_json daemon = {{"ticks", 12'000},
                                   {"overruns", 7},
                                   {"longest_overrun", 2},
                                   {"control_overruns", 4},
                                   {"max_disp_mm", 9.0},
                                   {"control_longest_overrun", 1},
                                   {"tick_ms", {{"p99", 0.5}, {"max", 1.0}}}};
  nlohmann::ordered_json watch = {{"snapshots", 1800}};
  nlohmann::ordered_json replay = {{"poses_accepted", 11'500}, {"poses_refused", 2}, {"max_depth_mm", 45.0}};
};

TEST_F(Judge, PassesARunWhereEveryTickIsCertifiedOrFlagged) {
  const Ended ended = verdict();
  EXPECT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.out.find("stress: ok"), std::string::npos) << ended.out;
}

TEST_F(Judge, FailsAFoldThatIsNotFlagged) {
  ticks.unflagged = 1;
  EXPECT_TRUE(fails_for("ticks that are neither injective nor flagged"));
}

TEST_F(Judge, FailsAFrameThatIsNotFinite) {
  frames.nonfinite = 1;
  EXPECT_TRUE(fails_for("frames with coordinates that are not finite"));
}

TEST_F(Judge, FailsABurstOfMissedDeadlinesThatIsNotTheMachines) {
  daemon["longest_overrun"] = 3;
  EXPECT_TRUE(fails_for("a burst of missed deadlines"));
  daemon["control_longest_overrun"] = 3;
  EXPECT_TRUE(exited(verdict(), 0));
  daemon["overruns"] = 10;
  EXPECT_TRUE(fails_for("more deadlines missed than the machine's own"));
}

TEST_F(Judge, FailsARunThatStressedNothing) {
  replay["max_depth_mm"] = 0.0;
  EXPECT_TRUE(fails_for("the needle was not in the gland"));
  replay["max_depth_mm"] = 45.0;
  replay["poses_accepted"] = 9000;
  EXPECT_TRUE(fails_for("too few poses"));
}

}  // namespace
}  // namespace brachy
