// The example adapter, without the hardware: events from a file, against a daemon.
#include <gtest/gtest.h>
#include <linux/input.h>

#include <cstring>
#include <string>

#include "test_paths.h"
#include "tests/apps/running_brachyd.h"

namespace brachy::test {
namespace {

std::string event(int type, int code, int value) {
  input_event e{};
  e.type = static_cast<decltype(e.type)>(type);
  e.code = static_cast<decltype(e.code)>(code);
  e.value = value;
  std::string bytes(sizeof e, '\0');
  std::memcpy(bytes.data(), &e, sizeof e);
  return bytes;
}

TEST(SpacenavDevice, PushesTheNeedleAsFarAsTheEventsSay) {
  TempFolder folder;
  RunningBrachyd daemon(folder.write("scene.toml", small_scene()));
  std::string events;
  for (int i = 0; i < 100; ++i)  // half a second at full deflection, 30 mm/s
    events += event(EV_REL, REL_Z, 350) + event(EV_KEY, BTN_0, 1) + event(EV_SYN, SYN_REPORT, 0);
  const std::string file = folder.write("events.bin", events);
  const Ended ended = ChildProcess({SPACENAV_DEVICE_BINARY, daemon.address, file}).wait();
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  EXPECT_EQ(ended.out, "100 poses sent, tip at   0   0 -45 mm\n");
  daemon.process.send_signal(SIGTERM);
  const auto summary = json_of(daemon.process.wait());
  EXPECT_EQ(summary.at("poses_accepted"), 100);
  EXPECT_EQ(summary.at("seeds_dropped"), 1);  // one press; behind the template a seed stays where the tip is
  EXPECT_EQ(summary.at("drops_refused"), 0);
}

TEST(SpacenavDevice, SaysWhatIsWrong) {
  const auto run = [](const std::vector<std::string>& arguments) {
    std::vector<std::string> line = {SPACENAV_DEVICE_BINARY};
    line.insert(line.end(), arguments.begin(), arguments.end());
    return ChildProcess(line).wait();
  };
  EXPECT_TRUE(refused_in_one_line(run({}), {"usage"}));
  EXPECT_TRUE(refused_in_one_line(run({"127.0.0.1:1", "/nowhere/event0"}), {"/nowhere/event0", "group"}));
  TempFolder folder;
  EXPECT_TRUE(refused_in_one_line(run({"127.0.0.1:1", folder.write("none", "")}), {"127.0.0.1:1"}));
}

}  // namespace
}  // namespace brachy::test
