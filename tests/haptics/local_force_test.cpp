#include "haptics/force/local_force.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "tests/core/simulation/allocation_guard.h"
#include "tests/haptics/milliseconds.h"

namespace brachy {
namespace {

Vec3 at(double z, double x = 0) {
  return {x, 0, z};
}

/// Tissue that sticks up to ±1 N of friction and 0.5 N of cutting, 1 N/mm, force 0 at z = 0.
LocalContactModel tissue() {
  LocalContactModel m;
  m.tick = 1;
  m.in_contact = true;
  m.axial_stiffness_n_per_mm = 1;
  m.axial_min_n = -1;
  m.axial_max_n = 1.5;
  m.lateral_stiffness_n_per_mm = 0.5;
  return m;
}

LocalContactModel capsule_ahead() {
  LocalContactModel m;
  m.tick = 1;
  m.is_capsule = true;
  m.axial_stiffness_n_per_mm = 0.8;
  m.axial_max_n = 1.2;
  m.after_puncture_n = 0.3;
  m.reference_tip = at(-5);
  return m;
}

/// Along the shaft without limits of size and slew: > 0 pushes the needle out.
double axial(LocalForce& local, double z, std::int64_t now) {
  std::uint32_t flags = 0;
  return -local.wanted(at(z), now, now, flags).z();
}

TEST(LocalForce, SticksThenSlipsAndFallsAtOnceWhenTheNeedleTurns) {
  LocalForce local;
  local.take(tissue(), LocalForce::kUnknown, 0);
  std::int64_t t = 0;
  EXPECT_NEAR(axial(local, 0.7, ++t), 0.7, 1e-12);
  EXPECT_NEAR(axial(local, 1.5, ++t), 1.5, 1e-12);
  EXPECT_NEAR(axial(local, 4.0, ++t), 1.5, 1e-12);  // slips: the contact point is now at 2.5
  EXPECT_NEAR(axial(local, 3.5, ++t), 1.0, 1e-12);
  EXPECT_NEAR(axial(local, 2.5, ++t), 0.0, 1e-12);
  EXPECT_NEAR(axial(local, 1.5, ++t), -1.0, 1e-12);
  EXPECT_NEAR(axial(local, 0.0, ++t), -1.0, 1e-12);  // slips the other way: at 1
  EXPECT_NEAR(axial(local, 0.5, ++t), -0.5, 1e-12);
}

TEST(LocalForce, DissipatesAroundEveryClosedPath) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> step(-0.4, 0.4);
  for (int path = 0; path < 200; ++path) {
    LocalForce local;
    LocalContactModel m = tissue();
    m.time_to_live_s = 1e6;
    local.take(m, LocalForce::kUnknown, 0);
    double z = 0, work = 0, force = 0;  // done by the hand
    std::int64_t t = 0;
    const auto go = [&](double to) {
      // Small enough that a step's force is its mean: the law is piecewise linear.
      for (int i = 1; i <= 200; ++i) {
        const double next = axial(local, z + (to - z) * i / 200, ++t);
        work += 0.5 * (force + next) * (to - z) / 200;
        force = next;
      }
      z = to;
    };
    for (int leg = 0; leg < 20; ++leg) go(z + 5 * step(random));
    go(0);
    // Back at the start the spring may still be loaded: its energy does not count as dissipated.
    EXPECT_GE(work, 0.5 * force * force - 1e-3) << path;
  }
}

TEST(LocalForce, ACapsuleAheadOnlyPushesAndGivesWayAtItsPuncture) {
  LocalForce local;
  local.take(capsule_ahead(), LocalForce::kUnknown, 0);
  std::int64_t t = 0;
  EXPECT_EQ(axial(local, -1, ++t), 0);
  EXPECT_NEAR(axial(local, 1, ++t), 0.8, 1e-12);
  EXPECT_EQ(axial(local, -0.5, ++t), 0) << "it does not hold the needle back";
  EXPECT_NEAR(axial(local, 1, ++t), 0.8, 1e-12) << "and stays where it was";
  EXPECT_NEAR(axial(local, 1.49, ++t), 1.192, 1e-12);
  EXPECT_NEAR(axial(local, 1.51, ++t), 0.3, 1e-12) << "through";
  EXPECT_NEAR(axial(local, 5, ++t), 0.3, 1e-12);
}

TEST(LocalForce, ACapsuleInsideDoesNotTakeTheFrictionBehindIt) {
  LocalForce local;
  LocalContactModel m = tissue();
  m.is_capsule = true;
  m.after_puncture_n = 0.5;
  local.take(m, LocalForce::kUnknown, 0);
  std::int64_t t = 0;
  EXPECT_NEAR(axial(local, -0.6, ++t), -0.6, 1e-12) << "withdrawn: pulled in";
  EXPECT_NEAR(axial(local, 1.4, ++t), 1.4, 1e-12);
  EXPECT_NEAR(axial(local, 1.6, ++t), 0.5, 1e-12) << "through";
  EXPECT_NEAR(axial(local, 0, ++t), -1, 1e-12);
}

TEST(LocalForce, AcrossTheShaftASpringAboutTheReference) {
  LocalForce local;
  LocalContactModel m = tissue();
  m.reference_tip = at(0.5, 1);
  m.lateral_n = Vec3(-0.2, 0, 0);
  local.take(m, LocalForce::kUnknown, 0);
  std::uint32_t flags = 0;
  const Vec3 force = local.wanted(at(0.6, 1.4), 1, 1, flags);
  EXPECT_NEAR((force - Vec3(-0.4, 0, -0.6)).norm(), 0, 1e-12);
  LocalContactModel free;
  local.take(free, LocalForce::kUnknown, 2);
  EXPECT_EQ(local.wanted(at(0.6, 1.4), 3, 3, flags), Vec3(Vec3::Zero()));
  EXPECT_EQ(flags, 0u);
}

TEST(LocalForce, WithoutANewModelTheForceGoesToZeroAtHalfANewtonAMillisecond) {
  LocalForce local;
  local.take(tissue(), LocalForce::kUnknown, 0);
  DeviceForce force;
  for (std::int64_t ms = 0; ms <= 50; ++ms) force = local.evaluate(at(1.4), ms * kMs);
  EXPECT_NEAR(force.force_n.z(), -1.4, 1e-12);
  const double expected[] = {-0.9, -0.4, 0, 0};
  for (int i = 0; i < 4; ++i) {
    force = local.evaluate(at(1.4), (51 + i) * kMs);
    EXPECT_NEAR(force.force_n.z(), expected[i], 1e-12) << i;
    EXPECT_TRUE(force.flags & kLocalExpired);
  }
  local.take(tissue(), LocalForce::kUnknown, 60 * kMs);
  EXPECT_NEAR(local.evaluate(at(1.4), 60 * kMs).force_n.z(), -0.5, 1e-12) << "back as fast, no faster";
}

TEST(LocalForce, ATipThatIsNotFiniteTakesTheForceAway) {
  LocalForce local;
  local.take(tissue(), LocalForce::kUnknown, 0);
  for (std::int64_t ms = 0; ms < 10; ++ms) local.evaluate(at(1), ms * kMs);
  const DeviceForce force = local.evaluate(at(std::numeric_limits<double>::quiet_NaN()), 10 * kMs);
  EXPECT_NEAR(force.force_n.z(), -0.5, 1e-12);
  EXPECT_TRUE(force.flags & kLocalNotFinite);
  EXPECT_EQ(local.evaluate(at(INFINITY), 11 * kMs).force_n, Vec3(Vec3::Zero()));
}

TEST(LocalForce, RefusesModelsThatMakeNoSense) {
  const auto refused = [](auto&& spoil) {
    LocalContactModel m = tissue();
    spoil(m);
    LocalForce local;
    return !local.take(m, LocalForce::kUnknown, 0) && !local.has_model();
  };
  EXPECT_TRUE(refused([](auto& m) { m.axis *= 2; }));
  EXPECT_TRUE(refused([](auto& m) { m.axis = Vec3::Zero(); }));
  EXPECT_TRUE(refused([](auto& m) { m.contact_point.y() = NAN; }));
  EXPECT_TRUE(refused([](auto& m) { m.axial_stiffness_n_per_mm = -1; }));
  EXPECT_TRUE(refused([](auto& m) { m.axial_max_n = NAN; }));
  EXPECT_TRUE(refused([](auto& m) { m.axial_min_n = 0.1; }));
  EXPECT_FALSE(refused([](auto&) {}));
  EXPECT_FALSE(refused([](auto& m) { m.axial_min_n = -INFINITY; })) << "tissue that never slips";
}

TEST(LocalForce, AModelOfAnOlderPoseSaysTheSameAsOneInTime) {
  // The hand goes 3 mm in and turns; a model 40 ms late must not bring the friction of the way in back.
  LocalForce in_time;
  LocalForce late;
  in_time.take(tissue(), LocalForce::kUnknown, 0);
  late.take(tissue(), LocalForce::kUnknown, 0);
  const auto hand = [](std::int64_t ms) {
    return ms < 30 ? 0.1 * static_cast<double>(ms) : 6 - 0.1 * static_cast<double>(ms);
  };
  // The simulation's state at 28 ms, still on the way in: slipping at 1.5 N.
  LocalContactModel then = tissue();
  then.reference_tip = at(hand(28));
  then.contact_point = at(hand(28) - 1.5);
  for (std::int64_t ms = 1; ms <= 40; ++ms) {
    axial(in_time, hand(ms), ms * kMs);
    axial(late, hand(ms), ms * kMs);
  }
  ASSERT_TRUE(late.take(then, 28 * kMs, 40 * kMs));
  EXPECT_NEAR(axial(late, hand(41), 41 * kMs), axial(in_time, hand(41), 41 * kMs), 1e-9);
  LocalForce without;
  without.take(then, LocalForce::kUnknown, 40 * kMs);
  EXPECT_GT(axial(without, hand(41), 41 * kMs) - axial(in_time, hand(41), 41 * kMs), 0.05);
}

TEST(LocalForce, ACapsuleThatWasPuncturedHereStaysPuncturedWhenAnOlderModelArrives) {
  LocalForce local;
  local.take(capsule_ahead(), LocalForce::kUnknown, 0);
  for (std::int64_t ms = 1; ms <= 20; ++ms)
    axial(local, 0.1 * static_cast<double>(ms), ms * kMs);  // through at 1.5 mm
  LocalContactModel touching = capsule_ahead();
  touching.in_contact = true;
  touching.reference_tip = at(1);
  local.take(touching, 10 * kMs, 20 * kMs);
  EXPECT_NEAR(axial(local, 1.9, 21 * kMs), 0.3 - 0.08, 1e-9);
}

TEST(LocalForce, NeverMakesTheHandJumpWhateverTheModelsSay) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  LocalForce local({.max_force_n = 2});
  Vec3 last = Vec3::Zero();
  for (std::int64_t ms = 0; ms < 5000; ++ms) {
    if (ms % 5 == 0) {
      LocalContactModel m;
      m.in_contact = any(random) > -0.5;
      m.is_capsule = any(random) > 0.5;
      m.axis = Vec3(any(random), any(random), 2).normalized();
      m.reference_tip = Vec3(any(random), any(random), any(random));
      m.contact_point = m.reference_tip - any(random) * m.axis;
      m.axial_stiffness_n_per_mm = 50 * std::abs(any(random));
      m.axial_min_n = -5 * std::abs(any(random));
      m.axial_max_n = 20 * std::abs(any(random));
      m.lateral_n = Vec3(any(random), any(random), 0);
      m.lateral_stiffness_n_per_mm = 20 * std::abs(any(random));
      local.take(m, (ms - 20) * kMs, ms * kMs);
    }
    const Vec3 force = local.evaluate(Vec3(any(random), any(random), any(random)), ms * kMs).force_n;
    ASSERT_LE((force - last).norm(), 0.5 + 1e-12) << ms;
    ASSERT_LE(force.norm(), 2 + 1e-12) << ms;
    last = force;
  }
}

TEST(LocalForce, IsNoStifferThanTheLimitAndStillSlipsAtTheFullForce) {
  LocalForce local({.max_force_n = 10, .max_stiffness_n_per_mm = 0.1});
  const auto model_at = [](double tip) {  // as the simulation slips along: its contact point 1.5 mm behind
    LocalContactModel m = tissue();
    m.reference_tip = at(tip);
    m.contact_point = at(std::max(0.0, tip - 1.5));
    return m;
  };
  std::int64_t t = 0;
  double last = 0;
  for (int i = 0; i <= 300; ++i) {  // 30 mm in
    const double tip = 0.1 * i;
    local.take(model_at(tip), t, t);
    const double force = axial(local, tip, t += kMs);
    ASSERT_LE(force - last, 0.1 * 0.1 + 1e-9) << tip;
    last = force;
  }
  EXPECT_NEAR(last, 1.5, 1e-9);
  EXPECT_TRUE(local.evaluate(at(30), t += kMs).flags & kLocalStiffnessLimited);
}

TEST(LocalForce, DoesNotAllocate) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "the sanitizers own malloc";
  LocalForce local({.max_stiffness_n_per_mm = 0.5});
  const std::uint64_t before = test::allocation_count();
  for (std::int64_t ms = 0; ms < 2000; ++ms) {
    if (ms % 5 == 0) local.take(tissue(), (ms - 100) * kMs, ms * kMs);
    local.evaluate(at(0.002 * static_cast<double>(ms)), ms * kMs);
  }
  EXPECT_EQ(test::allocation_count(), before);
}

TEST(ModelLimits, AcrossTheShaftForceAndStiffnessAreMadeSmallerAlike) {
  LocalContactModel m = tissue();
  m.lateral_n = Vec3(0.4, 0, 0);
  StiffnessLimiter limiter;
  EXPECT_TRUE(limiter.apply(m, 0.25));
  EXPECT_EQ(m.lateral_n, Vec3(0.2, 0, 0));
  EXPECT_EQ(m.lateral_stiffness_n_per_mm, 0.25);
  EXPECT_EQ(m.axial_stiffness_n_per_mm, 0.25);
  EXPECT_EQ(m.axial_max_n, 1.5);
}

TEST(ModelLimits, AModelWithinTheLimitIsLeftAsItIs) {
  LocalContactModel m = tissue();
  EXPECT_FALSE(StiffnessLimiter().apply(m, 1));
  EXPECT_EQ(m, tissue());
}

TEST(ModelLimits, ScalingScalesTheForceAtEveryTip) {
  LocalForce whole, half;
  whole.take(tissue(), LocalForce::kUnknown, 0);
  half.take(scaled(tissue(), 0.5), LocalForce::kUnknown, 0);
  std::int64_t t = 0;
  for (const double z : {0.3, 1.2, 3.0, 2.2, -4.0, 1.0}) {
    ++t;
    EXPECT_NEAR(axial(half, z, t), 0.5 * axial(whole, z, t), 1e-12) << z;
  }
  LocalContactModel bonded = tissue();
  bonded.axial_max_n = INFINITY;
  LocalForce none;
  ASSERT_TRUE(none.take(scaled(bonded, 0), LocalForce::kUnknown, 0));
  EXPECT_EQ(axial(none, 3, t), 0);
}

}  // namespace
}  // namespace brachy
