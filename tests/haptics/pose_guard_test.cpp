#include "haptics/devices/pose_guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "haptics/devices/pose_plausibility.h"
#include "haptics/trajectory/needle_trajectories.h"
#include "test_paths.h"
#include "tests/haptics/milliseconds.h"

namespace brachy {
namespace {

constexpr std::int64_t kDeviceClockAhead = 7'000'000 * kMs;

/// Pose number n of a 200 Hz device whose clock is ahead of ours by an arbitrary amount; 1 ms under way.
NeedlePose pose_number(std::uint64_t n, std::int64_t extra_delay_ns = 0) {
  NeedlePose pose;
  pose.X_WN.R =
      Eigen::AngleAxisd(0.01 * static_cast<double>(n), Vec3(1, 2, 3).normalized()).toRotationMatrix();
  pose.X_WN.p = Vec3(1.25, -2.5, 1e-3 * static_cast<double>(n));
  pose.sequence = n;
  const std::int64_t taken_ns = static_cast<std::int64_t>(n) * 5 * kMs;
  pose.stamp_ns = taken_ns + kDeviceClockAhead;
  pose.received_ns = taken_ns + kMs + extra_delay_ns;
  return pose;
}

PoseStatus check(PoseGuard& guard, NeedlePose pose) {
  return guard.check(pose);
}

TEST(PoseGuard, GoodPosesPassBitForBit) {
  PoseGuard guard;
  for (std::uint64_t n = 1; n < 100; ++n) {
    NeedlePose pose = pose_number(n);
    pose.X_WN.R(0, 0) += 4e-10;  // as 9 digits on the wire leave it
    const NeedlePose before = pose;
    ASSERT_EQ(guard.check(pose), PoseStatus::kAccepted) << n;
    EXPECT_EQ(pose.X_WN, before.X_WN);
    EXPECT_EQ(pose.sequence, before.sequence);
    EXPECT_EQ(pose.stamp_ns, before.stamp_ns);
    EXPECT_EQ(pose.received_ns, before.received_ns);
  }
  EXPECT_EQ(guard.count(PoseStatus::kAccepted), 99u);
  EXPECT_EQ(guard.refused(), 0u);
}

TEST(PoseGuard, ARotationOffByLittleIsReplacedByTheNearest) {
  PoseGuard guard;
  NeedlePose pose = pose_number(1);
  const Mat3 right = pose.X_WN.R;
  pose.X_WN.R *= 1.0003;
  EXPECT_EQ(guard.check(pose), PoseStatus::kAccepted);
  EXPECT_LT((pose.X_WN.R - right).norm(), 1e-14);
}

TEST(PoseGuard, NanAndInfinityAreRefusedInEveryEntry) {
  PoseGuard guard;
  for (double bad :
       {std::nan(""), std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}) {
    for (int i = 0; i < 3; ++i) {
      NeedlePose pose = pose_number(1);
      pose.X_WN.p[i] = bad;
      EXPECT_EQ(guard.check(pose), PoseStatus::kNotFinite);
      for (int j = 0; j < 3; ++j) {
        pose = pose_number(1);
        pose.X_WN.R(i, j) = bad;
        EXPECT_EQ(guard.check(pose), PoseStatus::kNotFinite);
      }
    }
  }
  EXPECT_EQ(guard.count(PoseStatus::kNotFinite), 36u);
}

TEST(PoseGuard, WhatIsNoRotationIsRefused) {
  PoseGuard guard;
  const Mat3 R = pose_number(1).X_WN.R;
  for (const Mat3& bad : {Mat3(1.001 * R), Mat3(-R), Mat3(Mat3::Zero()), Mat3(1e200 * R), Mat3(1e-200 * R)}) {
    NeedlePose pose = pose_number(1);
    pose.X_WN.R = bad;
    EXPECT_EQ(guard.check(pose), PoseStatus::kNotRigid) << bad;
  }
  EXPECT_EQ(guard.count(PoseStatus::kNotRigid), 5u);
}

TEST(PoseGuard, ATipBeyondTenMetresIsRefused) {
  PoseGuard guard;
  for (double x : {10'001.0, -10'001.0, 1e300}) {
    NeedlePose pose = pose_number(1);
    pose.X_WN.p.y() = x;
    EXPECT_EQ(guard.check(pose), PoseStatus::kOutOfRange);
  }
  NeedlePose pose = pose_number(1);
  pose.X_WN.p.y() = -10'000;
  EXPECT_EQ(guard.check(pose), PoseStatus::kAccepted);
}

TEST(PoseGuard, GoingBackInTimeIsRefused) {
  PoseGuard guard;
  EXPECT_EQ(check(guard, pose_number(10)), PoseStatus::kAccepted);
  EXPECT_EQ(check(guard, pose_number(10)), PoseStatus::kOutOfOrder);
  EXPECT_EQ(check(guard, pose_number(9)), PoseStatus::kOutOfOrder);
  NeedlePose pose = pose_number(11);
  pose.sequence = 10;
  EXPECT_EQ(check(guard, pose), PoseStatus::kOutOfOrder);
  pose = pose_number(11);
  pose.stamp_ns = pose_number(10).stamp_ns;
  EXPECT_EQ(check(guard, pose), PoseStatus::kOutOfOrder);
  pose.stamp_ns = -1;
  EXPECT_EQ(check(guard, pose), PoseStatus::kOutOfOrder);
  EXPECT_EQ(guard.count(PoseStatus::kOutOfOrder), 5u);
  EXPECT_EQ(check(guard, pose_number(11)), PoseStatus::kAccepted);
}

TEST(PoseGuard, ARefusedPoseDoesNotCountAsTheLastOne) {
  PoseGuard guard;
  NeedlePose pose = pose_number(50);
  pose.X_WN.p.x() = std::nan("");
  EXPECT_EQ(check(guard, pose), PoseStatus::kNotFinite);
  EXPECT_EQ(check(guard, pose_number(1)), PoseStatus::kAccepted);
}

TEST(PoseGuard, APoseThatWaitedTooLongIsStaleWhateverTheClocksOffset) {
  PoseGuard guard;
  EXPECT_EQ(check(guard, pose_number(1)), PoseStatus::kAccepted);
  EXPECT_EQ(check(guard, pose_number(2, 100 * kMs)), PoseStatus::kAccepted);
  EXPECT_EQ(check(guard, pose_number(3, 101 * kMs)), PoseStatus::kStale);
  EXPECT_EQ(check(guard, pose_number(4)), PoseStatus::kAccepted);
}

TEST(PoseGuard, AStallsBacklogIsRefusedUntilItIsFresh) {
  PoseGuard guard;
  ASSERT_EQ(check(guard, pose_number(1)), PoseStatus::kAccepted);
  for (std::uint64_t n = 2; n <= 101; ++n) {  // 500 ms of poses arrive at once
    NeedlePose pose = pose_number(n);
    pose.received_ns = pose_number(101).received_ns;
    EXPECT_EQ(check(guard, pose), n < 81 ? PoseStatus::kStale : PoseStatus::kAccepted) << n;
  }
}

TEST(PoseGuard, TheFastestPoseSoFarSetsTheOffset) {
  PoseGuard guard;
  EXPECT_EQ(check(guard, pose_number(1, 300 * kMs)), PoseStatus::kAccepted);  // nothing to compare with yet
  EXPECT_EQ(check(guard, pose_number(2, 300 * kMs)), PoseStatus::kAccepted);
  EXPECT_EQ(check(guard, pose_number(3)), PoseStatus::kAccepted);
  EXPECT_EQ(check(guard, pose_number(4, 300 * kMs)), PoseStatus::kStale);
}

TEST(PoseGuard, StaleLimitIsASetting) {
  PoseGuard guard({.stale_ns = 10 * kMs});
  EXPECT_EQ(check(guard, pose_number(1)), PoseStatus::kAccepted);
  EXPECT_EQ(check(guard, pose_number(2, 11 * kMs)), PoseStatus::kStale);
}

TEST(PoseGuard, ASlowDeviceClockDoesNotGoStaleOverAnEightHourDay) {
  PoseGuard guard;
  for (std::uint64_t n = 1; n < 8 * 3600 * 200; n += 20) {
    NeedlePose pose = pose_number(n);
    pose.stamp_ns -= static_cast<std::int64_t>(n) * 500;  // 100 ppm: 2.9 s by the end
    ASSERT_EQ(guard.check(pose), PoseStatus::kAccepted) << n;
  }
}

TEST(PoseGuard, AStampFromTheEndsOfTimeDoesNotOverflow) {
  constexpr std::int64_t kEnd = std::numeric_limits<std::int64_t>::max();
  PoseGuard guard;
  NeedlePose pose = pose_number(1);
  pose.stamp_ns = 0;
  pose.received_ns = kEnd;
  EXPECT_EQ(check(guard, pose), PoseStatus::kAccepted);
  pose = pose_number(2);
  pose.stamp_ns = kEnd;
  pose.received_ns = 0;
  EXPECT_EQ(check(guard, pose), PoseStatus::kAccepted);
  pose = pose_number(3);
  pose.stamp_ns = std::numeric_limits<std::int64_t>::min();
  EXPECT_EQ(check(guard, pose), PoseStatus::kOutOfOrder);
}

TEST(PoseGuard, AResetForgetsTheClockAndTheCountButNotTheCounters) {
  PoseGuard guard;
  EXPECT_EQ(check(guard, pose_number(1000)), PoseStatus::kAccepted);
  EXPECT_EQ(check(guard, pose_number(1)), PoseStatus::kOutOfOrder);
  guard.reset();
  EXPECT_EQ(check(guard, pose_number(1, 5000 * kMs)), PoseStatus::kAccepted);
  EXPECT_EQ(guard.count(PoseStatus::kAccepted), 2u);
  EXPECT_EQ(guard.refused(), 1u);
}

TEST(PoseGuard, OnePoseStampedAheadCostsThoseAfterItNoMoreThanThree) {
  for (const std::uint64_t spoiled : {1, 20}) {
    PoseGuard guard;
    for (std::uint64_t n = 1; n <= 100; ++n) {
      NeedlePose pose = pose_number(n);
      if (n == spoiled) pose.stamp_ns += 5000 * kMs;
      const bool is_after = n > spoiled && n <= spoiled + 3;
      EXPECT_EQ(guard.check(pose), is_after ? PoseStatus::kOutOfOrder : PoseStatus::kAccepted) << n;
    }
    EXPECT_EQ(check(guard, pose_number(101, 101 * kMs)), PoseStatus::kStale) << "the delay is known again";
  }
}

TEST(PoseGuard, PosesThatWaitedDoNotReplaceTheFirst) {
  PoseGuard guard;
  ASSERT_EQ(check(guard, pose_number(1)), PoseStatus::kAccepted);
  ASSERT_EQ(check(guard, pose_number(2)), PoseStatus::kAccepted);  // which agrees with it
  for (std::uint64_t n = 3; n <= 50; ++n)
    EXPECT_EQ(check(guard, pose_number(n, 150 * kMs)), PoseStatus::kStale) << n;
}

/// Pose number n of a device whose clock is `ns` behind what it was.
NeedlePose set_back(std::uint64_t n, std::int64_t period_ns, std::int64_t ns) {
  NeedlePose pose = pose_number(n);
  pose.stamp_ns = static_cast<std::int64_t>(n) * period_ns + kDeviceClockAhead - ns;
  pose.received_ns = static_cast<std::int64_t>(n) * period_ns + kMs;
  return pose;
}

// As NTP does. It froze the needle until the device connected again.
TEST(PoseGuard, AClockThatIsSetBackCostsThreePoses) {
  for (const std::int64_t period_ns : {kMs, 5 * kMs, 16 * kMs, 100 * kMs})
    for (const std::int64_t back_ns : {2 * period_ns, 1000 * kMs, 3'600'000 * kMs}) {
      PoseGuard guard;
      std::uint64_t n = 1;
      for (; n < 200; ++n) ASSERT_EQ(check(guard, set_back(n, period_ns, 0)), PoseStatus::kAccepted);
      std::uint64_t refused = 0;
      for (; n < 220 && check(guard, set_back(n, period_ns, back_ns)) != PoseStatus::kAccepted; ++n)
        ++refused;
      EXPECT_LE(refused, 3u) << period_ns << " " << back_ns;
      ++n;
      for (; n < 400; ++n)
        ASSERT_EQ(check(guard, set_back(n, period_ns, back_ns)), PoseStatus::kAccepted) << n;
    }
}

// As Nagle's algorithm hands poses on, which waits for an acknowledgement of 40 ms: delays fall within each bundle.
TEST(PoseGuard, AClockThatIsSetBackIsFoundAlsoWherePosesComeInBundles) {
  for (const std::int64_t period_ns : {2 * kMs, 5 * kMs, 10 * kMs, 16 * kMs})
    for (std::uint64_t set_at = 100; set_at < 120; ++set_at) {  // anywhere in a bundle
      PoseGuard guard;
      std::uint64_t refused = 0;
      for (std::uint64_t n = 1; n < 200; ++n) {
        NeedlePose pose = set_back(n, period_ns, n < set_at ? 0 : 1000 * kMs);
        pose.received_ns += 40 * kMs - pose.received_ns % (40 * kMs);
        refused += check(guard, pose) != PoseStatus::kAccepted;
      }
      EXPECT_LE(static_cast<std::int64_t>(refused) * period_ns, 120 * kMs) << period_ns << " " << set_at;
    }
}

TEST(PoseGuard, WhatIsSentAgainIsNoClockThatIsSetBack) {
  PoseGuard guard;
  for (std::uint64_t n = 1; n < 200; ++n) ASSERT_EQ(check(guard, pose_number(n)), PoseStatus::kAccepted);
  for (std::uint64_t n = 50; n < 200; ++n) {
    NeedlePose again = pose_number(n);
    again.received_ns += 1000 * kMs;
    ASSERT_EQ(check(guard, again), PoseStatus::kOutOfOrder) << n;
  }
}

TEST(PoseGuard, PosesThatAreLateAndGoOnAreNoClockThatIsSetBack) {
  PoseGuard guard;
  for (std::uint64_t n = 1; n < 200; ++n) ASSERT_EQ(check(guard, pose_number(n)), PoseStatus::kAccepted);
  for (std::uint64_t n = 200; n < 400; ++n)
    ASSERT_EQ(check(guard, pose_number(n, 500 * kMs)), PoseStatus::kStale) << n;
}

/// The faults that are told of these poses, in any order.
std::uint32_t faults_of(PoseGuard& guard, const std::vector<NeedlePose>& poses) {
  std::uint32_t faults = 0;
  for (const NeedlePose& pose : poses) {
    check(guard, pose);
    faults |= guard.faults();
  }
  return faults | guard.faults_in_doubt();
}

TEST(PoseGuard, TellsWhatIsWrongInTime) {
  std::vector<NeedlePose> good;
  for (std::uint64_t n = 1; n <= 20; ++n) good.push_back(pose_number(n));
  const auto with = [&](std::vector<NeedlePose> more) {
    std::vector<NeedlePose> poses = good;
    poses.insert(poses.end(), more.begin(), more.end());
    poses.push_back(pose_number(40));
    PoseGuard guard;
    return faults_of(guard, poses);
  };
  EXPECT_EQ(with({}), 0u);
  EXPECT_EQ(with({pose_number(21, 300 * kMs)}), fault_bit(PoseFault::kLate));
  EXPECT_EQ(with({pose_number(20)}), fault_bit(PoseFault::kDoubled));
  EXPECT_EQ(with({pose_number(22), pose_number(21)}), fault_bit(PoseFault::kReordered));
}

// Those that are refused until a new offset is agreed upon are neither late nor reordered.
TEST(PoseGuard, TellsAClockThatIsSetFromLateAndReorderedPoses) {
  for (const std::int64_t step_ns : {-1000 * kMs, 1000 * kMs}) {
    PoseGuard guard;
    std::uint32_t faults = 0;
    for (std::uint64_t n = 1; n <= 60; ++n) {
      NeedlePose pose = pose_number(n);
      if (n > 30) pose.stamp_ns += step_ns;
      check(guard, pose);
      faults |= guard.faults();
    }
    EXPECT_EQ(faults | guard.faults_in_doubt(), fault_bit(PoseFault::kClockSet)) << step_ns;
  }
}

// Other work and a network hold single poses up, by less than the age at which they are refused, and those behind them.
TEST(PoseGuard, TellsAClockThatIsSetAlsoWhereDelaysDiffer) {
  std::mt19937 random(1);
  const auto uniform = [&](double least, double most) {
    return std::uniform_real_distribution(least, most)(random);
  };
  for (int device = 0; device < 3000; ++device) {
    const auto period_ns = static_cast<std::int64_t>(uniform(2e6, 20e6));
    const std::int64_t step_ns = device % 2 ? 1000 * kMs : -1000 * kMs;
    PoseGuard guard;
    std::vector<NeedlePose> poses;
    std::int64_t arrived_ns = 0;
    const auto poses_a_second = static_cast<std::uint64_t>(1000 * kMs / period_ns);
    for (std::uint64_t n = 1; n < 2 * poses_a_second; ++n) {
      NeedlePose pose = set_back(n, period_ns, n < poses_a_second ? 0 : step_ns);
      const double delay_ns = uniform(0, 1) < 0.1 ? uniform(20e6, 90e6) : uniform(0, 3e6);
      arrived_ns = std::max(arrived_ns, pose.received_ns + static_cast<std::int64_t>(delay_ns));
      pose.received_ns = arrived_ns;
      poses.push_back(pose);
    }
    EXPECT_EQ(faults_of(guard, poses), fault_bit(PoseFault::kClockSet)) << device << " " << period_ns;
  }
}

TEST(PoseGuard, NamesPosesThatGoOnBeingLateOrDoubled) {
  for (const std::int64_t late_ns : {0 * kMs, 500 * kMs}) {
    PoseGuard guard;
    std::uint32_t faults = 0;
    for (std::uint64_t n = 1; n < 200; ++n) {
      NeedlePose pose = pose_number(n < 100 || late_ns ? n : 99, n < 100 ? 0 : late_ns);
      pose.received_ns = pose_number(n, n < 100 ? 0 : late_ns).received_ns;
      check(guard, pose);
      faults |= guard.faults();
    }
    EXPECT_EQ(faults, fault_bit(late_ns ? PoseFault::kLate : PoseFault::kDoubled));
  }
}

TEST(PoseGuard, AFirstPoseThatCameLateIsNoClockThatIsSet) {
  PoseGuard guard;
  std::vector<NeedlePose> poses = {pose_number(1, 400 * kMs)};
  for (std::uint64_t n = 82; n <= 120; ++n) poses.push_back(pose_number(n));
  EXPECT_EQ(faults_of(guard, poses), 0u);
}

TEST(PoseGuard, EveryVerdictHasASentenceOfItsOwn) {
  std::set<std::string_view> sentences;
  for (std::size_t i = 0; i < kPoseStatuses; ++i) sentences.insert(to_string(static_cast<PoseStatus>(i)));
  EXPECT_EQ(sentences.size(), kPoseStatuses);
  EXPECT_FALSE(sentences.contains("unknown verdict"));
  std::set<std::string_view> faults;
  for (std::size_t i = 0; i < kPoseFaults; ++i) faults.insert(to_string(static_cast<PoseFault>(i)));
  EXPECT_EQ(faults.size(), kPoseFaults);
  EXPECT_FALSE(faults.contains("unknown fault"));
}

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
      straight.judge({Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitZ()).toRotationMatrix(), Vec3::Zero()});
  EXPECT_FALSE(flipped.is_refused);
  EXPECT_EQ(flipped.fault, PoseFault::kQuaternionOrder);
}

// A trainee's hand: into the tissue and out of it, also behind, a little or far, and across to other holes.
TEST(PosePlausibility, NamesNoHandThatGoesInAndOutOfTheTissue) {
  std::mt19937 random(1);
  const auto uniform = [&](double least, double most) {
    return std::uniform_real_distribution(least, most)(random);
  };
  for (int hand = 0; hand < 300; ++hand) {
    PosePlausibility plausibility(kBall);
    RigidTransform X;
    X.R = Eigen::AngleAxisd(uniform(0, 0.3), Vec3(1, uniform(-1, 1), 0).normalized()).toRotationMatrix();
    X.p = Vec3(uniform(-15, 15), uniform(-15, 15), uniform(-100, -26));
    for (int motion = 0; motion < 20; ++motion) {
      const bool is_in_front = X.p.z() < -kBall.radius_mm;
      const Vec3 to = is_in_front && motion % 2 ? Vec3(uniform(-15, 15), uniform(-15, 15), X.p.z())
                                                : Vec3(X.p.x(), X.p.y(), uniform(-100, 60));
      const double step_mm = uniform(0.1, 4);
      for (double left_mm = (to - X.p).norm(); left_mm > step_mm; left_mm = (to - X.p).norm()) {
        X.p += step_mm / left_mm * (to - X.p);
        ASSERT_FALSE(plausibility.judge(X).fault) << hand << ": " << X.p.transpose();
      }
    }
  }
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
