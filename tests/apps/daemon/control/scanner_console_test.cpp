#include "apps/daemon/control/scanner_console.h"

#include <gtest/gtest.h>

#include <cmath>

#include "haptics/devices/switched_device.h"

namespace brachy {
namespace {

struct ScannerConsoleTest : ::testing::Test {
  const ScannerSettings& handed_over() {
    console.reader().update();
    return console.reader().value();
  }

  Scene scene;
  struct Probe {
    Probe() { device.add_stepper({}); }
    SteppedProbe* stepper() { return device.stepper(); }
    SwitchedDevice device{{}, std::nullopt};
  };

  Probe probe;
  std::vector<net::ScannerMessage> published;
  ScannerConsole console{scene, &probe.device,
                         [this](const net::ScannerMessage& m) { published.push_back(m); }};
};

TEST_F(ScannerConsoleTest, BeginsWithTheScenesSettings) {
  ASSERT_EQ(published.size(), 1u);
  EXPECT_EQ(published[0].array, net::ScannerArray::kTransverse);
  EXPECT_EQ(published[0].freeze, net::ScannerFreeze::kLive);
  EXPECT_EQ(published[0].depth_mm, scene.ultrasound.depth_mm);
  EXPECT_EQ(published[0].focus_mm, scene.ultrasound.focus_mm);
  EXPECT_EQ(published[0].flags, 0u);
  EXPECT_EQ(handed_over().settings, scene.ultrasound);
}

TEST_F(ScannerConsoleTest, ARequestChangesWhatItNamesAndNothingElse) {
  const std::uint64_t version = handed_over().version;
  net::ScannerMessage request;
  request.gain_db = 6;
  request.array = net::ScannerArray::kBiplane;
  console.update({}, 40);
  EXPECT_EQ(console.execute(request), "");
  EXPECT_EQ(published.back().gain_db, 6);
  EXPECT_EQ(published.back().array, net::ScannerArray::kBiplane);
  EXPECT_EQ(published.back().depth_mm, scene.ultrasound.depth_mm);
  EXPECT_EQ(published.back().tick, 40u);
  EXPECT_TRUE(handed_over().is_biplane);
  EXPECT_EQ(handed_over().settings.gain_db, 6);
  EXPECT_GT(handed_over().version, version);
}

TEST_F(ScannerConsoleTest, FreezingAndSteppingLeaveTheImagersAsTheyAre) {
  const std::uint64_t version = handed_over().version;
  net::ScannerMessage request;
  request.freeze = net::ScannerFreeze::kFrozen;
  request.probe_depth_mm = 5;
  EXPECT_EQ(console.execute(request), "");
  EXPECT_TRUE(handed_over().is_frozen);
  EXPECT_EQ(handed_over().place, (StepperPlace{5, 0}));
  EXPECT_EQ(handed_over().version, version);
  EXPECT_TRUE(probe.stepper()->is_on());
  EXPECT_EQ(published.back().flags, net::kProbeIsStepped);
}

TEST_F(ScannerConsoleTest, OfARequestThatIsRefusedNothingIsDone) {
  net::ScannerMessage request;
  request.gain_db = 3;
  request.depth_mm = 700;
  EXPECT_EQ(console.execute(request), "depth_mm 700 is not between 10 and 150");
  EXPECT_EQ(handed_over().settings, scene.ultrasound);
  request.depth_mm = INFINITY;
  EXPECT_NE(console.execute(request), "");
  request = {};
  request.probe_rotation_deg = 181;
  EXPECT_NE(console.execute(request), "");
  request = {};
  request.array = static_cast<net::ScannerArray>(9);
  EXPECT_NE(console.execute(request), "");
  EXPECT_EQ(published.size(), 1u);
  EXPECT_FALSE(probe.stepper()->is_on());
}

TEST_F(ScannerConsoleTest, ADeviceHasTheProbeBeforeTheStepper) {
  net::ScannerMessage request;
  request.probe_depth_mm = 10;
  EXPECT_EQ(console.execute(request), "");
  console.on_probe_device(true);
  EXPECT_FALSE(probe.stepper()->is_on());
  EXPECT_EQ(published.back().flags, net::kProbeHasDevice);
  EXPECT_EQ(published.back().probe_depth_mm, 0);
  EXPECT_EQ(console.execute(request), "a device moves the probe: disconnect it before using the stepper");
  request = {};
  request.gain_db = 1;
  EXPECT_EQ(console.execute(request), "") << "the console is still free";
  console.on_probe_device(false);
  EXPECT_EQ(published.back().flags, 0u);
  request.probe_depth_mm = 10;
  EXPECT_EQ(console.execute(request), "");
}

}  // namespace
}  // namespace brachy
