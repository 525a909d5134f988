// The gamepad's adapter, without the hardware: events from a file, against a daemon.
#include <gtest/gtest.h>
#include <linux/input.h>

#include <cstring>
#include <string>

#include "test_paths.h"
#include "tests/apps/running_brachyd.h"

namespace brachy::test {
namespace {

std::string stick_event(int type, int code, int value) {
  input_event e{};
  e.type = static_cast<decltype(e.type)>(type);
  e.code = static_cast<decltype(e.code)>(code);
  e.value = value;
  std::string bytes(sizeof e, '\0');
  std::memcpy(bytes.data(), &e, sizeof e);
  return bytes;
}

TEST(GamepadDevice, TheRightStickPushesTheNeedleInAndAButtonDropsASeed) {
  TempFolder folder;
  RunningBrachyd daemon(folder.write("scene.toml", small_scene()));
  std::string events;
  for (int i = 0; i < 100; ++i)  // half a second at full deflection
    events += stick_event(EV_ABS, ABS_RY, -32768) + stick_event(EV_ABS, ABS_X, 2000) +
              stick_event(EV_KEY, BTN_SOUTH, i > 50) + stick_event(EV_SYN, SYN_REPORT, 0);
  const std::string file = folder.write("events.bin", events);
  const Ended ended = ChildProcess({GAMEPAD_DEVICE_BINARY, daemon.address, "--input", file}).wait();
  EXPECT_TRUE(exited(ended, 1)) << "the file's end is the device's";
  EXPECT_NE(ended.err.find("the device is gone"), std::string::npos) << ended.err;
  daemon.process.send_signal(SIGTERM);
  const auto summary = json_of(daemon.process.wait());
  EXPECT_GT(summary.at("poses_accepted").get<int>(), 50);
  EXPECT_EQ(summary.at("poses_refused"), 0);
  EXPECT_EQ(summary.at("seeds_dropped"), 1);
}

TEST(GamepadDevice, SaysWhatIsWrong) {
  const auto run = [](const std::vector<std::string>& arguments) {
    std::vector<std::string> line = {GAMEPAD_DEVICE_BINARY};
    line.insert(line.end(), arguments.begin(), arguments.end());
    return ChildProcess(line).wait();
  };
  EXPECT_TRUE(refused_in_one_line(run({}), {"usage"}));
  EXPECT_TRUE(refused_in_one_line(run({"127.0.0.1:1"}), {"usage", "--input"}));
  EXPECT_TRUE(
      refused_in_one_line(run({"127.0.0.1:1", "--input", "/nowhere/event0"}), {"/nowhere/event0", "group"}));
  TempFolder folder;
  const std::string none = folder.write("none", "");
  EXPECT_TRUE(refused_in_one_line(run({"127.0.0.1:1", "--input", none}), {"127.0.0.1:1"}));
  EXPECT_TRUE(refused_in_one_line(run({"127.0.0.1:1", "--input", none, "--start", "1,2"}),
                                  {"--start 1,2: expected 3 numbers"}));
  const std::vector<std::vector<std::string>> wrong = {{"127.0.0.1:99999"},
                                                       {"127.0.0.1:0"},
                                                       {"127.0.0.1:80x"},
                                                       {"127.0.0.1:1", "--needle", "-1"},
                                                       {"127.0.0.1:1", "--needle", "1.5"},
                                                       {"127.0.0.1:1", "--needle", "65535"},
                                                       {"127.0.0.1:1", "--scale", "0"},
                                                       {"127.0.0.1:1", "--scale", "nan"},
                                                       {"127.0.0.1:1", "--scale", "-1"},
                                                       {"127.0.0.1:1", "--seconds", "inf"},
                                                       {"127.0.0.1:1", "--start", "0,nan,0"},
                                                       {"127.0.0.1:1", "--start", "1,2,3,4"},
                                                       {"127.0.0.1:1", "--start", "1,2,3,"}};
  for (std::vector<std::string> words : wrong) {
    const std::string value = words.size() > 1 ? words[1] + " " + words[2] : words[0].substr(10);
    words.insert(words.end(), {"--input", none});
    EXPECT_TRUE(refused_in_one_line(run(words), {value + ": expected"}));
  }
}

}  // namespace
}  // namespace brachy::test
