#include "haptics/trajectory/needle_trajectories.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "haptics/devices/scripted_device.h"

namespace brachy {
namespace {

const std::string kPlain = std::string(kTrajectoryHeader) + "\n";
const std::string kSeveral = std::string(kTrajectoryHeader) + ",needle\n";
const std::string kPlainButton = std::string(kTrajectoryHeader) + ",button\n";
const std::string kSeveralButton = std::string(kTrajectoryHeader) + ",needle,button\n";

/// A row at t with the tip at (x, 0, 0) and no rotation.
std::string needle_row(const std::string& t, const std::string& x, const std::string& needle = "") {
  return t + ",1,0,0," + x + ",0,1,0,0,0,0,1,0" + (needle.empty() ? "" : "," + needle) + "\n";
}

std::string needles_error(const std::string& text, std::size_t needle_count = kMaxTrajectoryNeedles) {
  try {
    parse_trajectories(text, "t.csv", needle_count);
  } catch (const UserError& error) {
    return error.what();
  }
  return "no error";
}

/// Needle 0 from 1 s to 3 s, needle 5 from 2 s to 4 s.
NeedleTrajectories two_needles() {
  return parse_trajectories(kSeveral + needle_row("1", "0", "0") + needle_row("2", "100", "5") +
                                needle_row("3", "20", "0") + needle_row("4", "140", "5"),
                            "t.csv");
}

TEST(NeedleTrajectories, AFileWithoutTheColumnIsNeedleZeros) {
  const NeedleTrajectories read =
      parse_trajectories(kPlain + needle_row("1", "2") + needle_row("3", "4"), "t.csv", 1);
  ASSERT_EQ(read.needles().size(), 1u);
  EXPECT_EQ(read.needles()[0].id, 0u);
  EXPECT_EQ(read.id_count(), 1u);
  EXPECT_EQ(read.needles()[0].motion.samples(),
            parse_trajectory(kPlain + needle_row("1", "2") + needle_row("3", "4"), "t.csv").samples());
}

TEST(NeedleTrajectories, RowsGoToTheirNeedlesOnOneClock) {
  const NeedleTrajectories read = two_needles();
  ASSERT_EQ(read.needles().size(), 2u);
  EXPECT_EQ(read.needles()[1].id, 5u);
  EXPECT_EQ(read.id_count(), 6u);
  EXPECT_EQ(read.start_s(), 1);
  EXPECT_EQ(read.end_s(), 4);
  EXPECT_EQ(read.duration_s(), 3);
  EXPECT_EQ(read.sample(0, 2)->p.x(), 10);
  EXPECT_EQ(read.sample(5, 2.5)->p.x(), 110);
}

TEST(NeedleTrajectories, ANeedleIsAbsentBeforeItsFirstRowAndHeldAfterItsLast) {
  const NeedleTrajectories read = two_needles();
  EXPECT_FALSE(read.sample(5, 1.999999));
  EXPECT_TRUE(read.sample(5, 2 - 1e-10));  // a tick's time is a product, a row's is what was written
  EXPECT_EQ(read.sample(0, 4)->p.x(), 20);
  for (std::uint32_t id : {1u, 4u, 6u, 4'000'000'000u}) EXPECT_FALSE(read.sample(id, 3)) << id;
}

TEST(NeedleTrajectories, DifferentNeedlesMayHaveRowsAtTheSameTime) {
  const NeedleTrajectories read =
      parse_trajectories(kSeveral + needle_row("0", "1", "1") + needle_row("0", "2", "0"), "t.csv", 2);
  EXPECT_EQ(read.sample(0, 0)->p.x(), 2);
  EXPECT_EQ(read.sample(1, 0)->p.x(), 1);
}

TEST(NeedleTrajectories, RefusesTimesThatGoBackOrStandStillForANeedle) {
  const std::string first = kSeveral + needle_row("0", "1", "0") + needle_row("1", "1", "1");
  EXPECT_TRUE(needles_error(first + needle_row("1", "2", "1"))
                  .starts_with("t.csv:4: t_s does not increase for needle 1"));
  EXPECT_TRUE(needles_error(first + needle_row("0.5", "2", "1"))
                  .starts_with("t.csv:4: t_s does not increase for needle 1"));
  const std::string sorted = needles_error(first + needle_row("0.5", "2", "0"));
  EXPECT_TRUE(sorted.starts_with("t.csv:4: t_s goes back to 0.5")) << sorted;
  EXPECT_NE(sorted.find("sort the rows"), sorted.npos) << sorted;
  EXPECT_EQ(needles_error(first + needle_row("1", "2", "0")), "no error");
}

TEST(NeedleTrajectories, RefusesIdsThatAreNone) {
  for (const char* id : {"-1", "25", "0.5", "1e9", "-0.25"}) {
    const std::string message =
        needles_error(kSeveral + needle_row("0", "1", "0") + needle_row("1", "1", id));
    EXPECT_TRUE(message.starts_with("t.csv:3: needle ")) << message;
    EXPECT_NE(message.find("whole numbers from 0 to 24"), message.npos) << message;
  }
  EXPECT_TRUE(
      needles_error(kSeveral + needle_row("0", "1", "nan")).starts_with("t.csv:2: column 14 is 'nan'"));
  EXPECT_TRUE(
      needles_error(kSeveral + needle_row("0", "1")).starts_with("t.csv:2: found 13 columns, expected 14"));
  EXPECT_EQ(needles_error(kSeveral + needle_row("0", "1", "16")), "no error");
}

TEST(NeedleTrajectories, ANeedleThatTheSceneHasNotNamesTheSettingToRaise) {
  const std::string text = kSeveral + needle_row("0", "1", "0") + needle_row("1", "1", "3");
  const std::string message = needles_error(text, 2);
  EXPECT_TRUE(message.starts_with("t.csv:3: moves needle 3")) << message;
  EXPECT_NE(message.find("raise needle.count in the scene to 4"), message.npos) << message;
  EXPECT_EQ(needles_error(text, 4), "no error");
}

TEST(NeedleTrajectories, RefusesOtherColumns) {
  EXPECT_TRUE(needles_error(std::string(kTrajectoryHeader) + ",force\n" + needle_row("0", "1", "0"))
                  .starts_with("t.csv:1: unknown columns 'force'"));
  EXPECT_TRUE(needles_error(std::string(kTrajectoryHeader) + ",needle,needle\n" + needle_row("0", "1", "0"))
                  .starts_with("t.csv:1: unknown columns 'needle'"));
}

TEST(NeedleTrajectories, MovingAndSpeedingUpMovesAllNeedlesAlike) {
  const NeedleTrajectories read = two_needles();
  const NeedleTrajectories moved = read.transformed({Mat3::Identity(), Vec3(1, 2, 3)});
  EXPECT_EQ(moved.sample(0, 2)->p, Vec3(11, 2, 3));
  EXPECT_EQ(moved.sample(5, 2)->p, Vec3(101, 2, 3));
  const NeedleTrajectories fast = read.sped_up(2);
  EXPECT_EQ(fast.duration_s(), 1.5);
  EXPECT_EQ(fast.sample(5, 1.25)->p.x(), 110);
  const NeedleTrajectories centred = read.centred_on(Vec3(0, 0, 7));
  EXPECT_EQ(centred.sample(5, 2)->p - centred.sample(0, 2)->p, Vec3(90, 0, 0));
  EXPECT_EQ(centred.sample(0, 2)->p.z(), 7);
}

TEST(NeedleTrajectories, OneNeedleIsCentredAsItsTrajectoryIs) {
  const std::string text = kPlain + needle_row("0", "3") + needle_row("1", "4.7") + needle_row("7", "9.1");
  const Vec3 centre(0.1, 0.2, 0.3);
  EXPECT_EQ(parse_trajectories(text, "t.csv").centred_on(centre).needles()[0].motion.samples(),
            parse_trajectory(text, "t.csv").centred_on(centre).samples());
}

TEST(NeedleTrajectories, ARowWithItsNeedleIsReadBackBitForBit) {
  const TrajectorySample sample{0.1, {Mat3::Identity(), Vec3(1.0 / 3, -2e-17, 1e3)}};
  const NeedleTrajectories read = parse_trajectories(kSeveral + trajectory_row(sample, 7) + "\n", "t.csv");
  ASSERT_EQ(read.needles()[0].id, 7u);
  EXPECT_EQ(read.needles()[0].motion.samples()[0], sample);
}

/// Needle 2 presses at 1 s, releases at 1.5 s and presses again from 2 s to 2.001 s; needle 0 never does.
NeedleTrajectories two_presses() {
  return parse_trajectories(kSeveralButton + needle_row("0", "0", "0,0") + needle_row("0", "0", "2,0") +
                                needle_row("1", "1", "2,1") + needle_row("1.2", "1", "0,0") +
                                needle_row("1.5", "2", "2,0") + needle_row("2", "3", "2,1") +
                                needle_row("2.001", "3", "2,0") + needle_row("3", "3", "2,0"),
                            "t.csv");
}

TEST(NeedleTrajectories, AButtonIsHeldFromItsRowToTheNextRowOfItsNeedle) {
  const NeedleTrajectories read = two_presses();
  for (const auto& [t_s, held] : {std::pair{-1.0, false},
                                  {0.999, false},
                                  {1.0, true},
                                  {1.0 - 1e-10, true},
                                  {1.499, true},
                                  {1.5, false},
                                  {1.999, false},
                                  {2.0005, true},
                                  {2.001, false},
                                  {9, false}})
    EXPECT_EQ(read.button(2, t_s), held) << t_s;
  EXPECT_FALSE(read.button(0, 1.2));
  EXPECT_FALSE(read.button(1, 1.2));
}

TEST(NeedleTrajectories, APressBetweenTwoTicksIsSeenOnceByTheLaterOne) {
  const NeedleTrajectories read = two_presses();
  EXPECT_FALSE(read.button(2, 1.98, 1.99));
  EXPECT_TRUE(read.button(2, 1.99, 2.01));  // pressed and let go in between
  EXPECT_FALSE(read.button(2, 2.01, 2.03));
  EXPECT_TRUE(read.button(2, 1.99, 2));
  EXPECT_FALSE(read.button(2, 2, 2.01));  // the tick at 2 s has seen it
  EXPECT_TRUE(read.button(2, -INFINITY, 3));
  EXPECT_FALSE(read.button(0, -INFINITY, 3));
  EXPECT_FALSE(read.button(7, -INFINITY, 3));
}

TEST(NeedleTrajectories, TicksOfAnyRateSeeEveryPressOnce) {
  const NeedleTrajectories read = two_presses();
  for (const double period_s : {0.0007, 0.005, 0.02, 0.3}) {
    int presses = 0;
    double last_s = -INFINITY;
    for (bool before = false; last_s < 3;) {
      const double t_s = std::isfinite(last_s) ? last_s + period_s : 0;
      const bool now = read.button(2, last_s, t_s);
      presses += now && !before;
      before = now;
      last_s = t_s;
    }
    EXPECT_EQ(presses, 2) << period_s;
  }
}

TEST(NeedleTrajectories, SamplesAtTicksAreSeenAsTheyAre) {
  // A recording tick by tick, with a release of a single tick, replays as the same presses and releases.
  const std::vector<bool> pressed = {false, true, false, true, true, false, true};
  std::vector<TrajectorySample> samples;
  const auto time_of = [](std::size_t tick) { return 0.005 * static_cast<double>(tick); };
  for (std::size_t i = 0; i < pressed.size(); ++i) samples.push_back({time_of(i), {}, pressed[i]});
  const Trajectory recorded(samples);
  for (std::size_t i = 0; i < pressed.size(); ++i)
    EXPECT_EQ(recorded.button(i == 0 ? -INFINITY : time_of(i - 1), time_of(i)), pressed[i]) << i;
}

TEST(NeedleTrajectories, AButtonThatIsNeitherUpNorDownIsRefused) {
  for (const char* button : {"2", "-1", "0.5", "1e9"}) {
    const std::string message =
        needles_error(kPlainButton + needle_row("0", "1", "1") + needle_row("1", "1", button));
    EXPECT_TRUE(message.starts_with("t.csv:3: button ")) << message;
    EXPECT_NE(message.find("write 0 or 1"), message.npos) << message;
  }
  EXPECT_TRUE(needles_error(kPlainButton + needle_row("0", "1", "down"))
                  .starts_with("t.csv:2: column 14 is not a number"));
  EXPECT_TRUE(needles_error(kSeveralButton + needle_row("0", "1", "0"))
                  .starts_with("t.csv:2: found 14 columns, expected 15"));
}

TEST(NeedleTrajectories, AFileWithoutTheButtonIsReadAsOneThatNeverPresses) {
  const auto never =
      parse_trajectories(kPlainButton + needle_row("1", "2", "0") + needle_row("3", "4", "0"), "t.csv");
  const auto without = parse_trajectories(kPlain + needle_row("1", "2") + needle_row("3", "4"), "t.csv");
  EXPECT_EQ(never.needles()[0].motion.samples(), without.needles()[0].motion.samples());
  EXPECT_FALSE(without.button(0, -INFINITY, INFINITY));
  EXPECT_EQ(two_presses().sample(2, 1.25)->p.x(), 1.5);
}

TEST(NeedleTrajectories, ChangesToTheMotionKeepTheButton) {
  const NeedleTrajectories read = two_presses();
  for (const NeedleTrajectories& changed :
       {read.transformed({Mat3::Identity(), Vec3(1, 2, 3)}), read.centred_on(Vec3(1, 2, 3))}) {
    EXPECT_TRUE(changed.button(2, 1.25));
    EXPECT_FALSE(changed.button(2, 1.75));
  }
  EXPECT_TRUE(read.sped_up(4).button(2, 0.3));
  EXPECT_FALSE(read.sped_up(4).button(2, 0.4));
}

TEST(NeedleTrajectories, RowsWithTheirButtonAreReadBackBitForBit) {
  const TrajectorySample held{0.1, {Mat3::Identity(), Vec3(1.0 / 3, -2e-17, 1e3)}, true},
      up{0.2, {Mat3::Identity(), Vec3(2.0 / 3, 0, 1)}, false};
  for (const bool needle : {false, true}) {
    const TrajectoryColumns columns{needle, true};
    const NeedleTrajectories read =
        parse_trajectories(trajectory_header(columns) + "\n" + trajectory_row(held, 7, columns) + "\n" +
                               trajectory_row(up, 7, columns) + "\n",
                           "t.csv");
    ASSERT_EQ(read.needles()[0].id, needle ? 7u : 0u);
    EXPECT_EQ(read.needles()[0].motion.samples(), (std::vector{held, up}));
  }
  EXPECT_EQ(trajectory_header({}), kTrajectoryHeader);
  EXPECT_EQ(trajectory_row(held, 7, {.needle = true}), trajectory_row(held, 7));
  EXPECT_EQ(trajectory_row(held, 7, {}), trajectory_row(held));
}

constexpr std::int64_t kTick = 5'000'000;

/// The device of one needle of `all`, as the daemon makes it.
ScriptedDevice device_of(const NeedleTrajectories& all, std::size_t index, bool loop) {
  return ScriptedDevice(all.needles()[index].motion, loop, all.start_s(), all.end_s());
}

TEST(NeedleTrajectories, DevicesOfOneFileRunOnItsClock) {
  const NeedleTrajectories all = two_needles();
  ScriptedDevice first = device_of(all, 0, false), second = device_of(all, 1, false);
  NeedlePose a, b;
  for (std::int64_t tick = 0; tick <= 600; ++tick) {
    const double t_s = all.start_s() + 5e-3 * static_cast<double>(tick);
    EXPECT_TRUE(first.update(tick * kTick, a));
    EXPECT_EQ(second.update(tick * kTick, b), tick >= 200) << tick;
    EXPECT_TRUE(a.present);
    EXPECT_EQ(b.present, tick >= 200) << tick;
    EXPECT_NEAR(a.X_WN.p.x(), all.sample(0, t_s)->p.x(), 1e-6);
    if (b.present) {
      EXPECT_NEAR(b.X_WN.p.x(), all.sample(5, t_s)->p.x(), 1e-6);
    }
  }
  EXPECT_TRUE(first.finished());
  EXPECT_TRUE(second.finished());
}

TEST(NeedleTrajectories, DevicesPressAsTheFileSaysAlsoOverMissedTicks) {
  const NeedleTrajectories all = two_presses();
  for (const std::int64_t stride : {1, 7}) {
    ScriptedDevice device = device_of(all, 1, false);
    NeedlePose pose;
    int presses = 0;
    for (std::int64_t tick = 0; !device.finished(); tick += stride) {
      const bool before = pose.button;
      ASSERT_TRUE(device.update(tick * kTick, pose));
      presses += pose.button && !before;
      if (tick % 1000 == 210) {
        EXPECT_TRUE(pose.button);
      }
    }
    EXPECT_EQ(presses, 2) << stride;
    EXPECT_FALSE(pose.button);
  }
}

TEST(NeedleTrajectories, ALoopingDevicePressesInEveryLap) {
  const NeedleTrajectories all = two_presses();
  ScriptedDevice device = device_of(all, 1, true);
  NeedlePose pose;
  int presses = 0;
  for (std::int64_t tick = 0; tick < 3 * 600; ++tick) {
    const bool before = pose.button;
    device.update(tick * kTick, pose);
    presses += pose.button && !before;
  }
  EXPECT_EQ(presses, 6);
}

TEST(NeedleTrajectories, ALoopingDeviceTakesItsNeedleAwayUntilItsFirstRowComesAgain) {
  const NeedleTrajectories all = two_needles();
  ScriptedDevice device = device_of(all, 1, true);
  NeedlePose pose;
  for (std::int64_t tick = 0; tick < 600; ++tick) device.update(tick * kTick, pose);
  EXPECT_TRUE(pose.present);
  EXPECT_TRUE(device.update(600 * kTick, pose));  // told once
  EXPECT_FALSE(pose.present);
  EXPECT_FALSE(device.update(601 * kTick, pose));
  EXPECT_FALSE(pose.present);
  EXPECT_TRUE(device.update(800 * kTick, pose));
  EXPECT_TRUE(pose.present);
  EXPECT_EQ(pose.X_WN.p.x(), 100);
}

}  // namespace
}  // namespace brachy
