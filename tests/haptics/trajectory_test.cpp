#include "haptics/trajectory/trajectory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>

#include "haptics/trajectory/rigid_pose.h"
#include "tests/data_dir.h"

namespace brachy {
namespace {

RigidTransform random_pose(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
  return {q.normalized().toRotationMatrix(), 40 * Vec3(normal(random), normal(random), normal(random))};
}

Trajectory random_trajectory(std::size_t count) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> gap(1e-3, 0.2);
  std::vector<TrajectorySample> samples;
  double t_s = -1;
  for (std::size_t i = 0; i < count; ++i) samples.push_back({t_s += gap(random), random_pose(random)});
  return Trajectory(std::move(samples));
}

RigidTransform turned_about_z(double angle) {
  return {Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix(), Vec3::Zero()};
}

TEST(Trajectory, ASampleIsReturnedBitForBitWithinANanosecond) {
  const Trajectory trajectory = random_trajectory(50);
  for (const TrajectorySample& s : trajectory.samples()) {
    EXPECT_EQ(trajectory.sample(s.t_s), s.X_WN);
    EXPECT_EQ(trajectory.sample(s.t_s + 0.9e-9), s.X_WN);
    EXPECT_EQ(trajectory.sample(s.t_s - 0.9e-9), s.X_WN);
  }
}

TEST(Trajectory, TheEndsAreHeld) {
  const Trajectory trajectory = random_trajectory(5);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (double t_s : {-kInfinity, trajectory.start_s() - 1}) {
    EXPECT_EQ(trajectory.sample(t_s), trajectory.samples().front().X_WN);
  }
  for (double t_s : {kInfinity, trajectory.end_s() + 1}) {
    EXPECT_EQ(trajectory.sample(t_s), trajectory.samples().back().X_WN);
  }
}

TEST(Trajectory, BetweenSamplesPositionIsLinearAndRotationIsSlerp) {
  RigidTransform b = turned_about_z(std::numbers::pi / 2);
  b.p = Vec3(10, -20, 30);
  const Trajectory trajectory({{2.0, RigidTransform()}, {4.0, b}});
  const RigidTransform middle = trajectory.sample(3.0);
  EXPECT_LT((middle.p - Vec3(5, -10, 15)).norm(), 1e-14);
  EXPECT_LT((middle.R - turned_about_z(std::numbers::pi / 4).R).norm(), 1e-14);
  const RigidTransform early = trajectory.sample(2.5);
  EXPECT_LT((early.p - Vec3(2.5, -5, 7.5)).norm(), 1e-14);
  EXPECT_LT((early.R - turned_about_z(std::numbers::pi / 8).R).norm(), 1e-14);
}

TEST(Trajectory, InterpolatedPosesAreRigid) {
  const Trajectory trajectory = random_trajectory(20);
  for (double t_s = trajectory.start_s(); t_s < trajectory.end_s(); t_s += 0.00137) {
    ASSERT_LT(rigidity_error(trajectory.sample(t_s)), 1e-14);
  }
}

TEST(Trajectory, ASingleSampleIsAPoseForAllTimes) {
  const Trajectory trajectory({{1.0, turned_about_z(1)}});
  EXPECT_EQ(trajectory.duration_s(), 0);
  EXPECT_EQ(trajectory.tip_path_mm(), 0);
  for (double t_s : {0.0, 1.0, 2.0}) EXPECT_EQ(trajectory.sample(t_s), turned_about_z(1));
}

TEST(Trajectory, TransformedMovesEveryPoseAndKeepsThePathLength) {
  std::mt19937_64 random(9);
  const Trajectory trajectory = random_trajectory(30);
  const RigidTransform X_VW = random_pose(random);
  const Trajectory moved = trajectory.transformed(X_VW);
  ASSERT_EQ(moved.samples().size(), 30u);
  for (std::size_t i = 0; i < 30; ++i) {
    const TrajectorySample& before = trajectory.samples()[i];
    EXPECT_EQ(moved.samples()[i].t_s, before.t_s);
    EXPECT_EQ(moved.samples()[i].X_WN, X_VW * before.X_WN);
  }
  EXPECT_NEAR(moved.tip_path_mm(), trajectory.tip_path_mm(), 1e-9);
}

TEST(Trajectory, DwellsWhereTheTipSpendsHalfItsTime) {
  // A long way in fast, then a stay at z = 7 … 9 for most of the time.
  std::vector<TrajectorySample> samples;
  for (const auto& [t, z] :
       {std::pair{0.0, -60.0}, {0.5, -20.0}, {1.0, 7.0}, {4.0, 8.0}, {8.0, 9.0}, {8.2, -60.0}})
    samples.push_back({t, {Mat3::Identity(), Vec3(1, 2, z)}});
  EXPECT_EQ(Trajectory(samples).dwelling_point(), Vec3(1, 2, 8));
  EXPECT_EQ(Trajectory({samples[1]}).dwelling_point(), Vec3(1, 2, -20));
}

TEST(Trajectory, CentredOnBringsTheDwellingPointThere) {
  const Vec3 p_W(1, 2, 3);
  const Trajectory trajectory = random_trajectory(30);
  const Trajectory centred = trajectory.centred_on(p_W);
  EXPECT_LT((centred.dwelling_point() - p_W).norm(), 1e-12);
  for (std::size_t i = 0; i < 30; ++i) EXPECT_EQ(centred.samples()[i].X_WN.R, trajectory.samples()[i].X_WN.R);
}

TEST(Trajectory, WritingAndReadingGivesTheSameBits) {
  const Trajectory trajectory = random_trajectory(200);
  std::ostringstream out;
  write_trajectory(out, trajectory);
  EXPECT_EQ(parse_trajectory(out.str(), "log").samples(), trajectory.samples());
}

TEST(Trajectory, InterpolatedAndTransformedPosesSurviveTheFileBitForBit) {
  const Trajectory trajectory = random_trajectory(20).transformed(turned_about_z(0.3));
  std::vector<TrajectorySample> ticks;
  for (int tick = 0; tick < 300; ++tick) {
    const double t_s = trajectory.start_s() + tick * 0.005;
    ticks.push_back({t_s, trajectory.sample(t_s)});
  }
  std::ostringstream out;
  write_trajectory(out, Trajectory(ticks));
  EXPECT_EQ(parse_trajectory(out.str(), "log").samples(), ticks);
}

TEST(Trajectory, AButtonSurvivesTheFileAndWithoutOneTheFileHasNoColumn) {
  std::vector<TrajectorySample> samples = random_trajectory(20).samples();
  std::ostringstream without, with;
  write_trajectory(without, Trajectory(samples));
  EXPECT_TRUE(without.str().starts_with(std::string(kTrajectoryHeader).append("\n")));
  samples[7].button = true;
  write_trajectory(with, Trajectory(samples));
  EXPECT_EQ(parse_trajectory(with.str(), "log").samples(), samples);
}

TEST(Trajectory, ExtremeNumbersSurviveTheFile) {
  RigidTransform X_WN;
  X_WN.p = Vec3(5e-324, -0.0, 1e4);
  std::ostringstream out;
  write_trajectory(out, Trajectory({{-1.0 / 3, X_WN}, {1'759'000'000.123456, X_WN}}));
  const Trajectory read = parse_trajectory(out.str(), "log");
  EXPECT_EQ(read.samples()[0].t_s, -1.0 / 3);
  EXPECT_EQ(read.samples()[0].X_WN.p, X_WN.p);
  EXPECT_TRUE(std::signbit(read.samples()[0].X_WN.p.y()));
  EXPECT_EQ(read.samples()[1].t_s, 1'759'000'000.123456);
}

TEST(Trajectory, TheRecordedInsertionHasItsKnownSize) {
  BRACHY_REQUIRE_DATA(data);
  const Trajectory trajectory = load_trajectory(data / "trajectories" / "inplane_needle_tip.csv");
  EXPECT_EQ(trajectory.samples().size(), 222u);
  EXPECT_NEAR(trajectory.duration_s(), 27.437, 1e-9);
  // Published: 280.892 mm. The file's own polyline, summed independently in Python, is 2.4 µm shorter.
  EXPECT_NEAR(trajectory.tip_path_mm(), 280.892, 0.003);
  EXPECT_NEAR(trajectory.tip_path_mm(), 280.8895706, 1e-6);
  for (const TrajectorySample& s : trajectory.samples()) EXPECT_LT(rigidity_error(s.X_WN), 1e-14);
}

}  // namespace
}  // namespace brachy
