// `brachy replay --device-dynamics`, offline and against a daemon.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/apps/running_brachyd.h"

namespace brachy::test {
namespace {

struct Held {
  TempFolder folder;
  std::string scene = folder.write("scene.toml", small_scene()),
              trajectory = folder.write("in.csv", short_insertion(3));

  nlohmann::json offline(std::vector<std::string> more) {
    std::vector<std::string> line = {"replay", trajectory, "--offline",        "--config",
                                     scene,    "--json",   "--device-dynamics"};
    line.insert(line.end(), more.begin(), more.end());
    const Ended ended = run_brachy(line);
    EXPECT_TRUE(exited(ended, 0)) << ended.err;
    return json_of(ended);
  }
};

TEST(DeviceDynamicsReplay, OfflineTheHandNeitherRingsNorJumpsWhateverTheNetworkDoes) {
  Held held;
  for (const char* delay_ms : {"0", "5", "10", "20", "50"}) {
    const auto result = held.offline({"--delay-ms", delay_ms, "--drop", "0.01"});
    ASSERT_FALSE(result.is_discarded());
    const auto& hand = result.at("hand");
    EXPECT_FALSE(hand.at("oscillated")) << delay_ms << " ms: " << hand;
    EXPECT_LE(hand.at("largest_jump_n_per_ms").get<double>(), 0.5 + 1e-9) << delay_ms;
    EXPECT_GT(hand.at("peak_force_n").get<double>(), 0.5) << delay_ms;
    EXPECT_LE(hand.at("peak_force_n").get<double>(), 3.3 + 1e-9) << delay_ms;
    EXPECT_GT(result.at("max_depth_mm").get<double>(), 5) << delay_ms;
  }
}

TEST(DeviceDynamicsReplay, OfflineRunsAreAlike) {
  Held held;
  const std::vector<std::string> more = {"--delay-ms", "7", "--drop", "0.2", "--simple-client"};
  EXPECT_EQ(held.offline(more), held.offline(more));
}

TEST(DeviceDynamicsReplay, ADeviceWithoutALocalModelGetsTheStiffnessOfItsWire) {
  Held held;
  EXPECT_NEAR(held.offline({}).at("hand").at("max_stiffness_n_per_mm").get<double>(), 1, 1e-9);
  // 2b/(T + 2(8 ms + 2T)), T = 1 ms
  const auto simple = held.offline({"--simple-client", "--delay-ms", "4"});
  EXPECT_NEAR(simple.at("hand").at("max_stiffness_n_per_mm").get<double>(), 0.001 / 0.021, 1e-9);
}

TEST(DeviceDynamicsReplay, PlaysIntoADaemonAtItsOwnRate) {
  Held held;
  RunningBrachyd daemon(held.scene);
  const Ended ended = run_brachy({"replay", held.trajectory, "--connect", daemon.address, "--device-dynamics",
                                  "--delay-ms", "2", "--json"});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  const auto result = json_of(ended);
  ASSERT_FALSE(result.is_discarded()) << ended.out;
  EXPECT_GT(result.at("poses_accepted").get<int>(), 30);
  EXPECT_GT(result.at("max_depth_mm").get<double>(), 5);
  const auto& hand = result.at("hand");
  EXPECT_FALSE(hand.at("oscillated")) << hand;
  // A machine that lets this device wait for 50 ms makes the daemon remove its force, which is told then.
  if (result.at("forces_removed") == 0)
    EXPECT_GT(hand.at("peak_force_n").get<double>(), 0.5);
  else
    EXPECT_NE(ended.err.find("force removed"), std::string::npos) << ended.err;
  EXPECT_LE(hand.at("peak_force_n").get<double>(), 3.3 + 1e-9);
  EXPECT_LE(hand.at("largest_jump_n_per_ms").get<double>(), 0.5 + 1e-9);
}

TEST(DeviceDynamicsReplay, ItsOptionsNeedIt) {
  EXPECT_TRUE(exited(run_brachy({"replay", "x.csv", "--offline", "--delay-ms", "5"}), 2));
  EXPECT_TRUE(exited(run_brachy({"replay", "x.csv", "--offline", "--device-dynamics", "--drop", "1.5"}), 2));
}

}  // namespace
}  // namespace brachy::test
