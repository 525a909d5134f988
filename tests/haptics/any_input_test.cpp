// Whatever comes, a hand gets a finite force within its limit that changes by at most 0.5 N/ms: ten million inputs of
// every class of numbers, for each of the last stages before a motor.
#include <gtest/gtest.h>

#include <cmath>

#include "haptics/force/force_gate.h"
#include "haptics/force/local_force.h"
#include "haptics/force/received_force.h"
#include "tests/haptics/any_number.h"
#include "tests/sanitized.h"

namespace brachy::test {
namespace {

constexpr std::uint64_t kInputs = kIsSanitized ? 100'000 : 10'000'000;
constexpr double kMaxForceN = 3.3;

/// Asserts the promise for each force in turn.
class Hand {
 public:
  ::testing::AssertionResult feel(const Vec3& force_n, std::int64_t now_ns) {
    const std::int64_t ns = started_ ? elapsed_ns(last_ns_, now_ns) : 0;
    const double most = kMaxSlewNPerMs * 1e-6 * static_cast<double>(std::min(ns, kLongestSlewNs));
    if (!force_n.allFinite()) return ::testing::AssertionFailure() << "not finite: " << force_n.transpose();
    if (force_n.norm() > kMaxForceN * (1 + 1e-12))
      return ::testing::AssertionFailure() << "above its limit: " << force_n.norm() << " N";
    if ((force_n - last_).norm() > most + 1e-12)
      return ::testing::AssertionFailure()
             << "changed by " << (force_n - last_).norm() << " N in " << ns << " ns";
    last_ = force_n;
    last_ns_ = now_ns;
    started_ = true;
    return ::testing::AssertionSuccess();
  }

 private:
  Vec3 last_ = Vec3::Zero();
  std::int64_t last_ns_ = 0;
  bool started_ = false;
};

TEST(AnyInput, LocalForceKeepsItsPromise) {
  auto number = numbers(22);
  LocalForce local({.max_force_n = kMaxForceN});
  Hand hand;
  std::int64_t now_ns = 0;
  std::uint64_t taken = 0, felt = 0;
  for (std::uint64_t i = 0; i < kInputs; ++i) {
    now_ns = next_time(number, now_ns);
    if (number.below(8) == 0) {
      const bool is_stamped = number.below(64) == 0;  // dragging through half a second of tips takes its time
      taken += local.take(number.model(), is_stamped ? number.any_time() : LocalForce::kUnknown, now_ns);
    }
    const DeviceForce force = local.evaluate(number.place(), now_ns);
    ASSERT_TRUE(hand.feel(force.force_n, now_ns)) << "input " << i;
    felt += force.force_n.norm() > 1;
  }
  EXPECT_GT(taken, kInputs / 20);
  EXPECT_GT(felt, kInputs / 10) << "the test must reach the forces it is about";
}

TEST(AnyInput, ReceivedForceKeepsItsPromise) {
  auto number = numbers(23);
  ReceivedForce received(kMaxForceN);
  Hand hand;
  std::int64_t now_ns = 0;
  std::uint64_t felt = 0;
  for (std::uint64_t i = 0; i < kInputs; ++i) {
    now_ns = next_time(number, now_ns);
    if (number.below(4) == 0) {
      const auto valid_ms =
          static_cast<std::uint32_t>(number.below(2) ? number.below(100) : number.below(UINT32_MAX));
      received.take(number.place(), valid_ms, number.below(50) == 0, now_ns);
    }
    if (number.below(200) == 0) received.arm();
    const Vec3 force_n = received.evaluate(now_ns);
    ASSERT_TRUE(hand.feel(force_n, now_ns)) << "input " << i;
    felt += force_n.norm() > 1;
  }
  EXPECT_GT(felt, kInputs / 100);
}

TEST(AnyInput, ForceGateKeepsItsPromise) {
  auto number = numbers(24);
  ForceGate gate;
  gate.connect(kMaxForceN);
  Hand hand;
  std::int64_t now_ns = 0;
  std::uint64_t felt = 0;
  for (std::uint64_t i = 0; i < kInputs; ++i) {
    now_ns = number.below(1000) == 0 ? number.any_time() : next_time(number, now_ns);
    if (number.below(100) != 0) gate.pose_accepted(now_ns);
    if (number.below(2000) == 0) gate.pose_not_finite();
    if (gate.latched() && number.below(20) == 0) gate.arm();
    const Vec3 force_n = gate.pass(number.place(), now_ns);
    ASSERT_TRUE(hand.feel(force_n, now_ns)) << "input " << i;
    felt += force_n.norm() > 1;
  }
  EXPECT_GT(felt, kInputs / 100);
}

TEST(AnyInput, OneSampleOfTheLargestDoubleLeavesNoTrace) {
  LocalForce local({.max_force_n = kMaxForceN});
  LocalContactModel m;
  m.in_contact = true;
  m.axial_stiffness_n_per_mm = 0.5;
  m.axial_min_n = -20;
  m.axial_max_n = 20;
  Vec3 last = Vec3::Zero();
  for (std::int64_t ms = 0; ms < 200; ++ms) {
    if (ms % 5 == 0) local.take(m, LocalForce::kUnknown, ms * 1'000'000);
    const bool is_spoilt = ms == 100;
    const Vec3 tip = is_spoilt ? Vec3(0, 0, std::numeric_limits<double>::max()) : Vec3(0, 0, 5);
    const DeviceForce force = local.evaluate(tip, ms * 1'000'000);
    ASSERT_TRUE(force.force_n.allFinite()) << ms;
    ASSERT_LE((force.force_n - last).norm(), kMaxSlewNPerMs + 1e-12) << ms;
    EXPECT_EQ((force.flags & kLocalNotFinite) != 0, is_spoilt) << ms;
    last = force.force_n;
  }
  EXPECT_NEAR(last.z(), -2.5, 1e-9);
}

TEST(AnyInput, LimitsThatAreNoNumbersGiveNoForce) {
  for (const double bad : {std::nan(""), -1.0, 0.0, -std::numeric_limits<double>::infinity()}) {
    for (const ForceLimits& limits :
         {ForceLimits{.max_force_n = bad}, ForceLimits{.max_stiffness_n_per_mm = bad}}) {
      LocalForce local(limits);
      LocalContactModel m;
      m.in_contact = true;
      m.lateral_n = Vec3(3, 0, 0);
      for (std::int64_t ms = 0; ms < 100; ++ms) {
        local.take(m, LocalForce::kUnknown, ms * 1'000'000);
        EXPECT_EQ(local.evaluate(Vec3::Zero(), ms * 1'000'000).force_n, Vec3(Vec3::Zero())) << bad;
      }
    }
  }
}

}  // namespace
}  // namespace brachy::test
