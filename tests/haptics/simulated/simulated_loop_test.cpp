#include "haptics/simulated/simulated_loop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "haptics/negotiation.h"

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
