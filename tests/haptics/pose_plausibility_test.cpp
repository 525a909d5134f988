#include "haptics/devices/pose_plausibility.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "haptics/trajectory/needle_trajectories.h"
#include "test_paths.h"

namespace brachy {
namespace {

const TissueBall kBall{Vec3(0, 0, 0), 25};

/// On its way in, tilted by 10°, a step of 1 mm a pose.
RigidTransform on_the_way(int n) {
  return {Eigen::AngleAxisd(0.17, Vec3(1, 2, 0).normalized()).toRotationMatrix(), Vec3(5, -3, -60.0 + n)};
}
/// w, x, y, z read as x, y, z, w.
RigidTransform with_w_first(RigidTransform X) {
  const Eigen::Quaterniond q(X.R);
  X.R = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
  return X;
}
RigidTransform in_metres(RigidTransform X) {
  X.p /= 1000;
  return X;
}

TEST(PosePlausibility, FindsMetresThatBeginOnTheWayAndTakesMmAgain) {
  PosePlausibility plausibility(kBall);
  for (int n = 0; n < 60; ++n) {
    const bool is_wrong = n >= 20 && n < 40;
    const auto verdict = plausibility.judge(is_wrong ? in_metres(on_the_way(n)) : on_the_way(n));
    EXPECT_EQ(verdict.is_refused, is_wrong) << n;
    EXPECT_EQ(verdict.fault, is_wrong ? std::optional(PoseFault::kMetres) : std::nullopt) << n;
  }
}

TEST(PosePlausibility, FindsAQuaternionInAnotherOrderThatBeginsOnTheWay) {
  PosePlausibility plausibility(kBall);
  for (int n = 0; n < 60; ++n) {
    const bool is_wrong = n >= 20 && n < 40;
    const auto verdict = plausibility.judge(is_wrong ? with_w_first(on_the_way(n)) : on_the_way(n));
    EXPECT_EQ(verdict.is_refused, is_wrong) << n;
    EXPECT_EQ(verdict.fault, is_wrong ? std::optional(PoseFault::kQuaternionOrder) : std::nullopt) << n;
  }
}

TEST(PosePlausibility, NamesButTakesWhatIsWrongFromTheFirstPoseOn) {
  for (const auto& [wrong, fault] :
       {std::pair(&in_metres, PoseFault::kMetres), std::pair(&with_w_first, PoseFault::kQuaternionOrder)}) {
    PosePlausibility plausibility(kBall);
    std::set<PoseFault> named;
    for (int n = 0; n < 80; ++n) {
      const auto verdict = plausibility.judge(wrong(on_the_way(n)));
      EXPECT_FALSE(verdict.is_refused) << n;
      if (verdict.fault) named.insert(*verdict.fault);
    }
    EXPECT_EQ(named, std::set{fault});
  }
}

// A hand may be anywhere next, and a bevel is flipped: half a turn about the shaft is named and taken.
TEST(PosePlausibility, RefusesNoJump) {
  PosePlausibility plausibility(kBall);
  RigidTransform X = on_the_way(0);
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(300, 20, -100), Vec3(0.3, 0, -0.1), Vec3(-4, 0, -4)}) {
    X.p = p;
    EXPECT_FALSE(plausibility.judge(X).fault) << p.transpose();
  }
  X.R = X.R * Eigen::AngleAxisd(1.0, Vec3::UnitX()).toRotationMatrix();
  EXPECT_FALSE(plausibility.judge(X).fault);
  PosePlausibility straight(kBall);
  EXPECT_FALSE(straight.judge({}).fault);
  const auto flipped =
      straight.judge({Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitZ()).toRotationMatrix(), {}});
  EXPECT_FALSE(flipped.is_refused);
  EXPECT_EQ(flipped.fault, PoseFault::kQuaternionOrder);
}

TEST(PosePlausibility, AnotherDeviceIsJudgedByItsOwnPoses) {
  PosePlausibility plausibility(kBall);
  plausibility.judge(on_the_way(0));
  plausibility.reset();
  EXPECT_FALSE(plausibility.judge(in_metres(on_the_way(1))).fault);
}

// At 200 poses a second and at 30, as recorded and centred on a tissue there.
TEST(PosePlausibility, FindsNothingInTheTrajectoriesThatComeWithIt) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(BRACHY_SOURCE_DIR "/config")) {
    if (entry.path().extension() != ".csv") continue;
    ++files;
    const NeedleTrajectories recorded = load_trajectories(entry.path());
    for (const NeedleTrajectories& motions : {recorded, recorded.centred_on(Vec3::Zero())})
      for (const double period_s : {0.005, 0.033})
        for (const NeedleTrajectories::Needle& needle : motions.needles()) {
          PosePlausibility plausibility(kBall);
          for (double t_s = motions.start_s(); t_s < motions.end_s(); t_s += period_s) {
            const auto X_WN = motions.sample(needle.id, t_s);
            ASSERT_FALSE(X_WN && plausibility.judge(*X_WN).fault) << entry.path() << " at " << t_s << " s";
          }
        }
  }
  EXPECT_GE(files, 5u);
}

}  // namespace
}  // namespace brachy
