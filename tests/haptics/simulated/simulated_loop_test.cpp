#include "haptics/simulated/simulated_loop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "haptics/force/negotiation.h"

namespace brachy {
namespace {

/// Tissue that never slips, `stiffness` N/mm about the origin: the linear case.
LoopSimulation bonded(double stiffness) {
  return [stiffness](const NeedlePose& pose) {
    LocalContactModel m;
    m.tick = 1;
    m.in_contact = true;
    m.reference_tip = pose.X_WN.p;
    m.axial_stiffness_n_per_mm = m.lateral_stiffness_n_per_mm = stiffness;
    m.axial_min_n = -1e9;
    m.axial_max_n = 1e9;
    m.lateral_n = -stiffness * Vec3(m.reference_tip.x(), m.reference_tip.y(), 0);
    return m;
  };
}

LoopSettings free_mass(double rate_hz, double delay_s, bool local_model) {
  LoopSettings s;
  s.device = {
      .hand_stiffness_n_per_mm = 0, .hand_damping_n_s_per_mm = 0, .rate_hz = rate_hz, .encoder_mm = 0};
  s.delay_s = delay_s;
  s.local_model = local_model;
  s.wire_hz = std::min(rate_hz, 1000.0);
  return s;
}

TEST(SimulatedLoop, ForcesFromTheWireAreLateByTheWayThereAndBackAndACycle) {
  for (const double delay_s : {0.0, 0.005, 0.02}) {
    SimulatedLoop loop(free_mass(1000, delay_s, false), bonded(0.001), {});
    loop.device().displace(Vec3(0, 0, 1));
    for (int i = 0; i < 200; ++i) loop.step({});
    EXPECT_NEAR(loop.longest_delay_s(), std::max(2 * delay_s, 0.001), 1e-9) << delay_s;
  }
}

TEST(SimulatedLoop, WellUnderTheLimitTheMassComesToRestAndFarAboveItDoesNot) {
  for (const bool local_model : {true, false}) {
    LoopSettings s = free_mass(1000, 0.01, local_model);
    const double limit = passive_stiffness_n_per_mm(s.device.damping_n_s_per_mm,
                                                    {.period_s = 0.001, .delay_s = local_model ? 0.0 : 0.02});
    for (const double share : {0.5, 2.0}) {
      SimulatedLoop loop(s, bonded(share * limit), {});
      loop.device().displace(Vec3(0, 0, 1e-3));
      for (int i = 0; i < 4000; ++i) loop.step({});
      double greatest = 0;
      for (int i = 0; i < 1000; ++i) {
        loop.step({});
        greatest = std::max(greatest, loop.device().tip().norm());
      }
      if (share < 1)
        EXPECT_LT(greatest, 5e-4) << local_model;
      else
        EXPECT_GT(greatest, 5e-3) << local_model;
    }
  }
}

// The server stops while the needle is pressed into the tissue: the hand must not be left with the last force.
TEST(SimulatedLoop, AForceFromAServerThatStoppedEndsWithinItsTimeToLive) {
  for (const bool local_model : {true, false}) {
    LoopSettings s = free_mass(1000, 0.002, local_model);
    s.device.hand_stiffness_n_per_mm = 0.3;
    s.device.hand_damping_n_s_per_mm = 0.005;
    s.server_ends_s = 1;
    SimulatedLoop loop(s, bonded(0.1), {});
    const RigidTransform hand{.p = Vec3(0, 0, 20)};
    Vec3 force_n = Vec3::Zero();
    while (loop.time_s() < 1) force_n = loop.step(hand);
    EXPECT_GT(force_n.norm(), 0.5) << local_model;
    while (loop.time_s() < 1.07) {  // delay, 50 ms, 3.3 N at 0.5 N/ms
      const Vec3 next = loop.step(hand);
      EXPECT_LE((next - force_n).norm(), kMaxSlewNPerMs + 1e-9);
      force_n = next;
    }
    EXPECT_EQ(force_n, Vec3(Vec3::Zero())) << local_model;
    EXPECT_EQ(loop.is_latched(), !local_model);
    while (loop.time_s() < 2) EXPECT_EQ(loop.step(hand), Vec3(Vec3::Zero()));
  }
}

/// Peak to peak of z over the next second.
double swing(SimulatedLoop& loop, double rate_hz) {
  double low = INFINITY, high = -INFINITY;
  for (int i = 0; i < static_cast<int>(rate_hz); ++i) {
    loop.step({});
    low = std::min(low, loop.device().tip().z());
    high = std::max(high, loop.device().tip().z());
  }
  return high - low;
}

// Encoder steps add energy that the limit does not account for. A free mass keeps a tremor: of a step at half the
// limit, of ten near it, where almost no damping is left. Any hand damps it.
TEST(SimulatedLoop, UnderTheLimitEncoderStepsLeaveATremorThatDoesNotGrow) {
  struct Grip {
    double stiffness, damping, share, steps;
  };
  for (const double rate_hz : {200.0, 1000.0, 2000.0}) {
    for (const Grip& grip :
         {Grip{0, 0, 0.1, 2}, Grip{0, 0, 0.5, 2}, Grip{0, 0, 0.9, 10}, Grip{0.05, 0.001, 0.99, 2}}) {
      LoopSettings s = free_mass(rate_hz, 0.01, true);
      s.device.hand_stiffness_n_per_mm = grip.stiffness;
      s.device.hand_damping_n_s_per_mm = grip.damping;
      s.device.encoder_mm = 0.05;
      const double limit = passive_stiffness_n_per_mm(s.device.damping_n_s_per_mm, {.period_s = 1 / rate_hz});
      SimulatedLoop loop(s, bonded(grip.share * limit), {});
      loop.device().displace(Vec3(0, 0, 0.5));
      for (int second = 0; second < 30; ++second) swing(loop, rate_hz);
      EXPECT_LE(swing(loop, rate_hz), grip.steps * s.device.encoder_mm) << rate_hz << " Hz, " << grip.share;
    }
  }
}

/// A wall that only pushes, from z = 0 on.
LoopSimulation wall(double stiffness) {
  return [stiffness](const NeedlePose& pose) {
    LocalContactModel m;
    m.tick = 1;
    m.is_capsule = true;
    m.in_contact = pose.X_WN.p.z() > 0;
    m.reference_tip = pose.X_WN.p;
    m.axial_stiffness_n_per_mm = stiffness;
    m.axial_max_n = m.after_puncture_n = 1e9;
    return m;
  };
}

// Released inside a wall, it leaves with at most the spring's energy.
TEST(SimulatedLoop, UnderTheLimitAWallGivesNoEnergyWhateverTheNetworksDelay) {
  for (const double delay_s : {0.0, 0.01, 0.05}) {
    for (const bool local_model : {true, false}) {
      LoopSettings s = free_mass(1000, delay_s, local_model);
      const ClosedLoop closed{.period_s = 0.001,
                              .delay_s = local_model ? 0 : wire_delay_s(2 * delay_s, 0.001)};
      SimulatedLoop loop(s, wall(passive_stiffness_n_per_mm(s.device.damping_n_s_per_mm, closed)),
                         {Mat3::Identity(), Vec3(0, 0, -1)});
      loop.device().displace(Vec3(0, 0, 2));
      double energy = 0.5 * passive_stiffness_n_per_mm(s.device.damping_n_s_per_mm, closed) * 4;
      for (int i = 0; i < 3000; ++i) {
        loop.step({});
        if (loop.device().tip().z() >= 0) continue;
        const double kinetic = 0.5 * 1e-3 * s.device.mass_kg * loop.device().velocity().squaredNorm();
        EXPECT_LE(kinetic, energy * (1 + 1e-9)) << delay_s << " " << local_model;
        energy = kinetic;
      }
      EXPECT_LT(loop.device().tip().z(), 0) << "it was thrown out";
    }
  }
}

TEST(SimulatedLoop, RunsAreAlike) {
  LoopSettings s = free_mass(1000, 0.01, true);
  s.drop_share = 0.3;
  SimulatedLoop a(s, bonded(0.2), {}), b(s, bonded(0.2), {});
  a.device().displace(Vec3(0, 0, 1));
  b.device().displace(Vec3(0, 0, 1));
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(a.step({}), b.step({})) << i;
  EXPECT_GT(a.poses_lost(), 200u);
}

}  // namespace
}  // namespace brachy
