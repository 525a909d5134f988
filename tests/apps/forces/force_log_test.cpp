#include "apps/forces/force_log.h"

#include <gtest/gtest.h>

#include <limits>

#include "apps/charts/svg_chart.h"
#include "apps/forces/force_chart.h"
#include "apps/forces/force_summary.h"
#include "core/base/error.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

const std::string kHeader = std::string(kForceLogHeader) + "\n";

/// A sample of a needle along z: cutting and friction are parts of the axial force.
ForceSample sample_at(double t_s, ContactState state, double depth_mm, double cutting_n, double friction_n) {
  ForceSample s;
  s.t_s = t_s;
  s.state = state;
  s.depth_mm = depth_mm;
  s.forces.cutting_n = cutting_n;
  s.forces.friction_n = friction_n;
  s.forces.axial_n = cutting_n + friction_n;
  s.forces.force_n = Vec3(0.3, -0.4, -s.forces.axial_n);
  s.forces.lateral_n = 0.5;
  s.landmarks = 3;
  s.min_det = 0.9;
  s.tip_deflection_mm = 0.125 * depth_mm;
  return s;
}

/// On the capsule to 5 N, in to 20 mm, and out.
std::vector<ForceSample> insertion() {
  std::vector<ForceSample> run;
  run.push_back(sample_at(0, ContactState::kFree, 0, 0, 0));
  run.push_back(sample_at(1, ContactState::kTouching, 0, 2, 0));
  run.push_back(sample_at(2, ContactState::kTouching, 0, 5, 0));
  run.push_back(sample_at(3, ContactState::kInserted, 10, 2, 1));
  run.push_back(sample_at(4, ContactState::kInserted, 20, 2, 2));
  run.push_back(sample_at(5, ContactState::kInserted, 20, 1.5, 2));
  run.push_back(sample_at(6, ContactState::kInserted, 10, 0, -2.5));
  run.push_back(sample_at(7, ContactState::kWithdrawn, 0, 0, 0));
  return run;
}

std::string parse_error(const std::string& text) {
  try {
    parse_force_log(text, "f.csv");
  } catch (const UserError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ForceLog, ARowIsTheShortestThatGivesTheSameBitsBack) {
  ForceSample sample = sample_at(0.1, ContactState::kInserted, 1.0 / 3, 1e-300, -2.5);
  sample.needle = 15;
  sample.min_det = -5e-324;
  const std::string row = force_row(sample);
  EXPECT_TRUE(row.starts_with("0.1,15,inserted,0.3333333333333333,0.3,-0.4,2.5,")) << row;
  EXPECT_EQ(parse_force_log(kHeader + row + "\n", "f.csv"), std::vector{sample});
}

TEST(ForceLog, ALogOfBeforeNeedlesBentIsReadAsOfRigidOnes) {
  ForceSample sample = sample_at(0, ContactState::kInserted, 10, 1, 0);
  const std::string row = force_row(sample, ForceColumns::kRigid);
  EXPECT_EQ(row + ",1.25", force_row(sample, ForceColumns::kUnguided));
  EXPECT_EQ(row + ",1.25,0,0,0", force_row(sample));
  const std::string header = std::string(kRigidForceLogHeader) + "\n";
  EXPECT_TRUE(header.ends_with(",landmarks,min_det\n"));
  sample.tip_deflection_mm = 0;
  EXPECT_EQ(parse_force_log(header + row + "\n", "f.csv"), std::vector{sample});
  EXPECT_TRUE(parse_error(header + row + ",1.25\n").starts_with("f.csv:2: found 14 columns, expected 13"));
  EXPECT_TRUE(parse_error(kHeader + row + "\n").starts_with("f.csv:2: found 13 columns, expected 17"));
}

TEST(ForceLog, WhatTheGuideDoesHasColumnsOfItsOwn) {
  ForceSample sample = sample_at(0, ContactState::kInserted, 10, 1, 0);
  sample.forces.guide_n = Vec3(0.25, -0.5, -0.125);
  sample.forces.force_n = Vec3(0.5, -0.25, -1.125);
  const std::string row = force_row(sample);
  EXPECT_TRUE(row.starts_with("0,0,inserted,10,0.25,0.25,-1,")) << row << ": the tissue's";
  EXPECT_TRUE(row.ends_with(",1.25,0.25,-0.5,-0.125")) << row;
  EXPECT_EQ(parse_force_log(kHeader + row + "\n", "f.csv"), std::vector{sample});
  // A log that lacks them has the whole, as before.
  const std::string before = force_row(sample, ForceColumns::kUnguided);
  EXPECT_TRUE(before.starts_with("0,0,inserted,10,0.5,-0.25,-1.125,")) << before;
  sample.forces.guide_n.setZero();
  EXPECT_EQ(parse_force_log(std::string(kUnguidedForceLogHeader) + "\n" + before + "\n", "f.csv"),
            std::vector{sample});
}

TEST(ForceLog, AnUnknownDetIsNanAndReadBack) {
  ForceSample sample = sample_at(0, ContactState::kTouching, 0, 1, 0);
  sample.min_det = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(parse_force_log(kHeader + force_row(sample) + "\n", "f.csv")[0].min_det));
}

TEST(ForceLog, EveryStateHasANameThatIsReadBack) {
  std::string text = kHeader;
  std::vector<ForceSample> all;
  for (int state = 0; state <= static_cast<int>(ContactState::kWithdrawn); ++state) {
    all.push_back(sample_at(state, static_cast<ContactState>(state), 0, 0, 0));
    text += force_row(all.back()) + "\r\n";
  }
  EXPECT_EQ(parse_force_log(text, "f.csv"), all);
}

TEST(ForceLog, ErrorsNameTheFileTheLineAndTheFix) {
  const std::string row = force_row(insertion()[1]);
  const auto expect = [](const std::string& text, const std::string& start, const std::string& part) {
    const std::string message = parse_error(text);
    EXPECT_TRUE(message.starts_with(start)) << message;
    EXPECT_NE(message.find(part), message.npos) << message;
  };
  expect("", "f.csv:1: ", "no rows");
  expect(kHeader, "f.csv:1: ", "no rows");
  expect("t_s,m00\n" + row, "f.csv:1: is not a force log", "expected the header t_s,needle,state");
  expect(kHeader + row.substr(0, 20) + "\n", "f.csv:2: found ", "truncated");
  expect(kHeader + row + "\n" + row + "\n", "f.csv:3: t_s does not increase for needle 0", "sorted");
  expect(kHeader + "x" + row + "\n", "f.csv:2: t_s is not a valid number", "");
  expect(kHeader + "0,-1" + row.substr(3) + "\n", "f.csv:2: needle is not a valid number", "");
  std::string state = row;
  state.replace(state.find("touching"), 8, "resting");
  expect(kHeader + state + "\n", "f.csv:2: state must be free, touching", "withdrawn");
}

TEST(ForceLog, RowsOfSeveralNeedlesMayShareATime) {
  ForceSample other = insertion()[1];
  other.needle = 1;
  EXPECT_EQ(
      parse_force_log(kHeader + force_row(insertion()[1]) + "\n" + force_row(other) + "\n", "f.csv").size(),
      2u);
}

TEST(ForceLogWriter, WritesWhatIsReadBackAndReplacesWhatWasThere) {
  const TempFolder folder;
  ForceLogWriter writer(folder / "f.csv");
  for (const ForceSample& sample : insertion()) writer.add(sample);
  writer.close();
  EXPECT_EQ(writer.rows(), insertion().size());
  EXPECT_EQ(load_force_log(folder / "f.csv"), insertion());
  ForceLogWriter(folder / "f.csv").close();
  EXPECT_EQ(read_file(folder / "f.csv"), std::string(kForceLogHeader) + "\n");
  EXPECT_THROW(ForceLogWriter(folder / "none/f.csv"), UserError);
  EXPECT_THROW(ForceLogWriter(folder / ""), UserError);
}

TEST(ForceLogWriter, AFullDiskIsToldByCloseWithTheReason) {
  ForceLogWriter writer("/dev/full");
  for (int i = 0; i < 50'000; ++i)
    writer.add(sample_at(i, ContactState::kFree, 0, 0, 0));  // more than its buffer
  EXPECT_LT(writer.rows(), 50'000u);
  try {
    writer.close();
    ADD_FAILURE() << "no error";
  } catch (const UserError& error) {
    ADD_FAILURE() << "not bad input: " << error.what();
  } catch (const std::runtime_error& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with("/dev/full: ")) << error.what();
    EXPECT_NE(std::string(error.what()).find("No space left"), std::string::npos) << error.what();
  }
}

TEST(ForcePeaks, AreThoseOfTheRun) {
  ForcePeaks peaks;
  for (const ForceSample& sample : insertion()) peaks.add(sample);
  EXPECT_EQ(peaks.samples(), 8u);
  EXPECT_EQ(peaks.out_n(), 5);
  EXPECT_EQ(peaks.in_n(), 2.5);
  EXPECT_EQ(peaks.lateral_n(), 0.5);
  EXPECT_EQ(peaks.puncture_n(), 5);
  EXPECT_EQ(peaks.depth_mm(), 20);
  EXPECT_EQ(peaks.deepest().t_s, 4);  // the first there
  EXPECT_EQ(peaks.min_det(), 0.9);
}

TEST(ForcePeaks, WithoutAPunctureThereIsNoneToTell) {
  ForcePeaks peaks;
  peaks.add(insertion()[0]);
  peaks.add(insertion()[1]);
  EXPECT_TRUE(std::isnan(peaks.puncture_n()));
  EXPECT_TRUE(std::isnan(share_of(0, 0)));
  EXPECT_EQ(share_of(1, 4), 0.25);
}

NeedleState pushed_back(double z_mm, double cutting_n, double friction_n) {
  NeedleState state;
  state.present = true;
  state.X_WN.p = Vec3(0, 0, z_mm);
  state.forces.cutting_n = cutting_n;
  state.forces.friction_n = friction_n;
  state.forces.axial_n = cutting_n + friction_n;
  state.forces.force_n = Vec3(0, 0, -state.forces.axial_n);
  return state;
}

TEST(ForceWork, OfALoopIsItsArea) {
  ForceWork work;
  // In over 10 mm against 2 N of cutting and 1 N of friction, out against 1 N.
  work.add(pushed_back(0, 2, 1), false);
  work.add(pushed_back(5, 2, 1), false);
  work.add(pushed_back(10, 2, 1), false);
  work.add(pushed_back(10, 0, -1), false);
  work.add(pushed_back(0, 0, -1), false);
  EXPECT_DOUBLE_EQ(work.cutting_nmm(), 20);
  EXPECT_DOUBLE_EQ(work.friction_nmm(), 10);
  EXPECT_DOUBLE_EQ(work.insertion_nmm(), 30);
  EXPECT_DOUBLE_EQ(work.hand_nmm(), 40);
}

TEST(ForceWork, OfAJumpOrAnAbsenceIsNone) {
  ForceWork work;
  work.add(pushed_back(0, 1, 1), false);
  work.add(pushed_back(100, 1, 1), true);
  work.leave();
  work.add(pushed_back(0, 1, 1), false);
  EXPECT_EQ(work.insertion_nmm(), 0);
  EXPECT_EQ(work.hand_nmm(), 0);
}

TEST(ForceWork, TurningAgainstATorqueIsWork) {
  ForceWork work;
  NeedleState state;
  state.forces.tip_torque_nmm = Vec3(0, -3, 0);
  work.add(state, false);
  state.X_WN.R = Eigen::AngleAxisd(0.01, Vec3::UnitY()).toRotationMatrix();
  work.add(state, false);
  EXPECT_NEAR(work.hand_nmm(), 0.03, 1e-12);
}

TEST(ForceChart, ATremblingHandDoesNotTurn) {
  std::vector<ForceSample> run;
  for (double depth : {0.0, 5.0, 4.8, 5.1, 10.0, 9.7, 9.4, 5.0, 5.3, 0.0})
    run.push_back(sample_at(static_cast<double>(run.size()), ContactState::kInserted, depth, 0, 0));
  EXPECT_EQ(on_the_way_out(run),
            (std::vector<bool>{false, false, false, false, false, true, true, true, true, true}));
}

TEST(ForceChart, ATipOnTheCapsuleIsOnItsWayInAgain) {
  std::vector<ForceSample> run = insertion();
  run.push_back(sample_at(8, ContactState::kTouching, 0, 1, 0));
  const std::vector<bool> out = on_the_way_out(run);
  EXPECT_TRUE(out[6]);
  EXPECT_FALSE(out[8]);
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(ForceChart, ShowsAllPartsBothWaysAgainstDepthAndTime) {
  const std::string svg = force_chart(insertion(), "a<b&\"c\"");
  EXPECT_TRUE(svg.starts_with("<?xml"));
  EXPECT_TRUE(svg.ends_with("</svg>\n"));
  EXPECT_NE(svg.find("a&lt;b&amp;&quot;c&quot;"), svg.npos);
  for (const char* text :
       {"insertion depth, mm", "time, s", "axial, in", "axial, out", "cutting, in", "friction, out"})
    EXPECT_EQ(count_of(svg, std::string(">") + text + "<"), 1u) << text;
  EXPECT_EQ(count_of(svg, "force on the needle, N"), 2u);
  EXPECT_EQ(count_of(svg, "<polyline"), 12u);  // 3 parts × 2 ways × 2 charts
  EXPECT_EQ(count_of(svg, "<svg"), 1u);
  EXPECT_EQ(count_of(svg, "nan"), 0u);
  EXPECT_EQ(count_of(svg, "inf"), 0u);
}

TEST(ForceChart, OneRowAndNotANumberAreDrawnWithoutNonsense) {
  std::vector<ForceSample> one = {sample_at(3, ContactState::kFree, 0, 0, 0)};
  EXPECT_EQ(count_of(force_chart(one, "one"), "nan"), 0u);
  one[0].forces.axial_n = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(count_of(force_chart(one, "one"), "nan"), 0u);
}

TEST(SvgChart, TicksAreRoundAndWithin) {
  EXPECT_EQ(round_ticks(0, 10, 5), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(round_ticks(-0.9, 2.1, 6), (std::vector<double>{-0.5, 0, 0.5, 1, 1.5, 2}));
  for (double scale : {1e-9, 0.3, 7.0, 1e6}) {
    const auto ticks = round_ticks(-scale, 2 * scale, 7);
    EXPECT_GE(ticks.size(), 3u) << scale;
    EXPECT_LE(ticks.size(), 9u) << scale;
  }
}

}  // namespace
}  // namespace brachy
