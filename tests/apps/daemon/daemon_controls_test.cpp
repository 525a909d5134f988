// Commands of an operator to a running daemon over a real socket: the scripted needle, reset, another model.
#include <gtest/gtest.h>

#include "test_paths.h"
#include "tests/apps/applicator.h"
#include "tests/apps/running_daemon.h"

namespace brachy {
namespace {

using namespace test;

constexpr const char* kInsertion = BRACHY_CONFIG_DIR "/insertion.csv";

net::ControlMessage ask(net::ControlAction action) {
  net::ControlMessage message;
  message.action = action;
  return message;
}

class Operator : public Peer {
 public:
  explicit Operator(bool keep_meshes = false)
      : Peer(net::Role::kOperator, net::kSubscribeScene, keep_meshes, "operator") {}

  /// Waits for WELCOME and the first frame.
  bool is_there(std::uint16_t port) {
    return join(port) && until([&] { return !frames.empty(); });
  }
  /// Serves the connection until a STATE comes that fulfils it.
  template <class Condition>
  bool until_state(Condition&& condition) {
    return until([&] { return !states.empty() && condition(states.back().controls); });
  }
};

Scene with_script() {
  Scene scene = small();
  scene.device.trajectory = kInsertion;
  return scene;
}

TEST(DaemonControls, TheScriptedNeedlePlaysStopsAndFreesTheLease) {
  RunningDaemon daemon(with_script());
  Operator boss;
  ASSERT_TRUE(boss.is_there(daemon.port()));
  ASSERT_TRUE(boss.until_state([](const auto& controls) { return controls.flags == net::kScriptIsThere; }));
  boss.client.control(ask(net::ControlAction::kPlay));
  ASSERT_TRUE(boss.until_state(
      [](const auto& controls) { return controls.flags == (net::kScriptIsThere | net::kScriptPlays); }));
  EXPECT_NE(boss.states.back().device_holder.find("scripted device"), std::string::npos);
  ASSERT_TRUE(boss.until([&] { return boss.needle().present; }));
  boss.client.control(ask(net::ControlAction::kStop));
  ASSERT_TRUE(boss.until([&] { return !boss.needle().present; }));
  ASSERT_TRUE(boss.until_state([](const auto& controls) { return controls.flags == net::kScriptIsThere; }));
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  ASSERT_TRUE(device.go(way_in()));

  boss.client.control(ask(net::ControlAction::kPlay));
  ASSERT_TRUE(boss.until([&] { return !boss.errors.empty(); }));
  EXPECT_EQ(boss.errors[0].code, net::ErrorCode::kControlRefused);
  EXPECT_NE(boss.errors[0].text.find("applicator"), std::string::npos) << boss.errors[0].text;
}

TEST(DaemonControls, WithoutATrajectoryThereIsNothingToPlayAndTheFixIsNamed) {
  RunningDaemon daemon(small());
  Operator boss;
  ASSERT_TRUE(boss.is_there(daemon.port()));
  boss.client.control(ask(net::ControlAction::kPlay));
  ASSERT_TRUE(boss.until([&] { return !boss.errors.empty(); }));
  EXPECT_NE(boss.errors[0].text.find("--trajectory"), std::string::npos) << boss.errors[0].text;
}

TEST(DaemonControls, AnotherModelGoesOnWithTimeAndSeeds) {
  RunningDaemon daemon(small());
  Operator boss(true);
  ASSERT_TRUE(boss.is_there(daemon.port()));
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  device.peer.stand_beside(boss);  // a model takes seconds to set up under ThreadSanitizer
  ASSERT_TRUE(device.go(way_in()));
  ASSERT_TRUE(device.drop());
  net::ControlMessage model = ask(net::ControlAction::kModel);
  for (const auto& [kernel, support] : {std::pair{"psi32", 20.0}, {"elastic", 20.0}, {"psi31", 9.0}}) {
    const std::uint64_t before = boss.last().message.tick;
    model.kernel = kernel;
    model.support_radius_mm = support;
    boss.client.control(model);
    ASSERT_TRUE(boss.until_state([&, k = kernel, s = support](const auto& controls) {
      return controls.kernel == k && controls.support_radius_mm == s && controls.flags == 0;
    })) << kernel;
    ASSERT_TRUE(boss.until([&] {
      return std::ranges::any_of(boss.frames, [&](const Peer::Frame& frame) {
        return frame.message.full && frame.message.tick > before;
      });
    }));
    EXPECT_TRUE(boss.has_event(net::EventKind::kNote, std::string("model: ") + kernel));
    ASSERT_TRUE(device.go(way_out()));
    ASSERT_TRUE(device.go(way_in()));
    ASSERT_TRUE(boss.until([&] { return boss.last().message.moved_vertices > 0; })) << kernel;
    EXPECT_EQ(boss.client.mesh().seeds().size(), 1u);
  }
  ASSERT_TRUE(device.go(way_out()));
  ASSERT_TRUE(boss.until([&] { return boss.last().message.moved_vertices == 0; }));
  EXPECT_EQ(boss.last().positions, boss.topology.rest_vertices);
  const Seed seed = boss.client.mesh().seeds().front();
  EXPECT_EQ(seed.position, seed.rest);
  EXPECT_EQ(daemon.stop().seeds_dropped, 1u);
}

TEST(DaemonControls, AModelThatTheSceneCannotHaveIsToldAndTheOldOneStays) {
  Scene scene = small();
  scene.box.size_mm = Vec3::Constant(30);  // the gland does not fit
  RunningDaemon daemon(scene);
  Operator boss;
  ASSERT_TRUE(boss.is_there(daemon.port()));
  net::ControlMessage model = ask(net::ControlAction::kModel);
  model.kernel = "elastic";
  boss.client.control(model);
  ASSERT_TRUE(
      boss.until([&] { return boss.has_event(net::EventKind::kWarning, "not done: model: elastic"); }));
  ASSERT_TRUE(boss.until([&] { return !boss.errors.empty(); }));
  EXPECT_EQ(boss.errors[0].code, net::ErrorCode::kControlRefused);
  EXPECT_NE(boss.errors[0].about_sequence, 0u);
  EXPECT_NE(boss.errors[0].text.find("box"), std::string::npos) << boss.errors[0].text;
  ASSERT_TRUE(boss.refresh_state());
  EXPECT_EQ(boss.states.back().controls.kernel, "psi31");
  EXPECT_EQ(boss.states.back().controls.flags, 0u);
  model.kernel = "jelly";
  boss.client.control(model);
  ASSERT_TRUE(boss.until([&] { return boss.errors.size() == 2; }));
  EXPECT_NE(boss.errors[1].text.find("psi31"), std::string::npos) << boss.errors[1].text;
  model.kernel = "";
  model.support_radius_mm = -3;
  boss.client.control(model);
  ASSERT_TRUE(boss.until([&] { return boss.errors.size() == 3; }));
  EXPECT_NE(boss.errors[2].text.find("0.5 and 500 mm"), std::string::npos) << boss.errors[2].text;
}

TEST(DaemonControls, AKernelIsOneOfAListAndNeverAFile) {
  RunningDaemon daemon(small());
  Operator boss;
  ASSERT_TRUE(boss.is_there(daemon.port()));
  net::ControlMessage model = ask(net::ControlAction::kModel);
  std::size_t refused = 0;
  for (const char* kernel : {"/etc/hostname", "../gland.stl", "auto", "psi31.toml"}) {
    model.kernel = kernel;
    boss.client.control(model);
    ASSERT_TRUE(boss.until([&] { return boss.errors.size() == refused + 1; })) << kernel;
    EXPECT_EQ(boss.errors[refused].code, net::ErrorCode::kControlRefused);
    EXPECT_NE(boss.errors[refused++].text.find("there is no kernel"), std::string::npos) << kernel;
  }
}

TEST(DaemonControls, ResetBeginsAnewWithoutSeedsOrDose) {
  RunningDaemon daemon(small());
  Operator boss(true);
  ASSERT_TRUE(boss.is_there(daemon.port()));
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  ASSERT_TRUE(device.go(way_in()));
  ASSERT_TRUE(device.drop());
  ASSERT_TRUE(boss.until([&] { return !boss.doses.empty() && boss.doses.back().seeds == 1; }));
  EXPECT_EQ(boss.doses.back().surface_gy.size(), boss.topology.surface_vertex_count);
  const std::uint64_t before = boss.last().message.tick;
  boss.client.control(ask(net::ControlAction::kReset));
  ASSERT_TRUE(boss.until([&] { return boss.last().message.tick < before; }));
  EXPECT_TRUE(boss.last().message.full);
  EXPECT_TRUE(boss.client.mesh().seeds().empty());
  EXPECT_EQ(boss.last().positions, boss.topology.rest_vertices);  // the needle starts in tissue at rest
  EXPECT_TRUE(boss.has_event(net::EventKind::kReset, "operator"));
  ASSERT_TRUE(boss.until([&] { return boss.doses.back().seeds == 0; }));
  EXPECT_EQ(boss.doses.back().structures.at(0).mean_gy, 0);
  ASSERT_TRUE(device.peer.until([&] { return device.seeds().empty(); }));
  ASSERT_TRUE(device.drop());
  EXPECT_EQ(device.seeds().front().id, 1u);
  const DaemonSummary summary = daemon.stop();
  EXPECT_EQ(summary.seeds_dropped, 2u);
  EXPECT_EQ(summary.loop.ticks, summary.loop.tick_ns.count());  // since the daemon's start
}

TEST(DaemonControls, AnOperatorDropsTheScriptedNeedlesSeeds) {
  Scene scene = with_script();
  scene.device.kind = "scripted";
  RunningDaemon daemon(scene);
  Operator boss;
  ASSERT_TRUE(boss.is_there(daemon.port()));
  ASSERT_TRUE(
      boss.until([&] { return !boss.frames.empty() && boss.needle().contact == ContactState::kInserted; }));
  boss.client.press(0, true);
  boss.client.press(0, false);
  EXPECT_TRUE(boss.until([&] { return boss.client.mesh().seeds().size() == 1; }));
}

TEST(DaemonControls, TheSceneIsShownToWhoAsks) {
  Scene scene = small();
  scene.plan_file = BRACHY_CONFIG_DIR "/plan.toml";
  RunningDaemon daemon(scene);
  Operator boss;
  ASSERT_TRUE(boss.is_there(daemon.port()));
  ASSERT_TRUE(boss.until([&] { return !boss.scenes.empty(); }));
  const net::SceneMessage& shown = boss.scenes.front();
  EXPECT_EQ(shown.needle_length_mm, scene.needle.length_mm);
  EXPECT_EQ(shown.template_grid, scene.template_grid);
  EXPECT_EQ(shown.planned_needles.size(), 20u);
  EXPECT_EQ(shown.planned_seeds.size(), 75u);
  ASSERT_EQ(shown.structures.size(), 2u);
  EXPECT_EQ(shown.structures[0].name, "urethra");
  EXPECT_EQ(shown.structures[1].name, "rectum");
  EXPECT_GT(shown.structures[1].triangles.size(), 100u);
  EXPECT_TRUE(std::ranges::count(shown.kernels, "elastic"));
}

}  // namespace
}  // namespace brachy
