#include "haptics/simulated/device_dynamics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace brachy {
namespace {

constexpr double kMass = 1e-4;  // N·s²/mm, the default's 0.1 kg

DeviceDynamicsSettings without_hand() {
  return {.damping_n_s_per_mm = 0.0005,
          .hand_stiffness_n_per_mm = 0,
          .hand_damping_n_s_per_mm = 0,
          .encoder_mm = 0};
}

TEST(DeviceDynamics, WithoutDampingTheGripsSpringKeepsItsEnergy) {
  DeviceDynamicsSettings s = without_hand();
  s.damping_n_s_per_mm = 0;
  s.hand_stiffness_n_per_mm = 0.3;
  DeviceDynamics device(s, Vec3::Zero());
  device.displace(Vec3(1, 0, -2));
  const auto energy = [&] {
    return 0.5 * kMass * device.velocity().squaredNorm() + 0.5 * 0.3 * device.tip().squaredNorm();
  };
  const double before = energy();
  for (int i = 0; i < 100'000; ++i) device.advance(Vec3::Zero(), Vec3::Zero());
  EXPECT_NEAR(energy() / before, 1, 1e-9);
}

TEST(DeviceDynamics, DampingTakesExactlyWhatTheEquationSays) {
  DeviceDynamics device(without_hand(), Vec3::Zero());
  const Vec3 push(0, 0, 0.2);
  for (int i = 0; i < 500; ++i) device.advance(push, Vec3::Zero());
  const double b = 0.0005, t = 0.5;  // x = F/b (t − m/b (1 − e^(−bt/m)))
  EXPECT_NEAR(device.tip().z(), 0.2 / b * (t - kMass / b * (1 - std::exp(-b * t / kMass))), 1e-8);
  EXPECT_NEAR(device.velocity().z(), 0.2 / b * (1 - std::exp(-b * t / kMass)), 1e-8);
}

TEST(DeviceDynamics, MovesTheSameAtEveryRate) {
  Vec3 ends[2];
  for (const int i : {0, 1}) {
    DeviceDynamicsSettings s = without_hand();
    s.hand_stiffness_n_per_mm = 0.3;
    s.hand_damping_n_s_per_mm = 0.005;
    s.rate_hz = i == 0 ? 200 : 4000;
    DeviceDynamics device(s, Vec3::Zero());
    const int cycles = static_cast<int>(s.rate_hz);
    for (int n = 1; n <= cycles; ++n)
      device.advance(Vec3(0.1, 0, 0), Vec3(0, 0, 20.0 * n / cycles));  // hand at 20 mm/s
    ends[i] = device.tip();
  }
  EXPECT_NEAR((ends[0] - ends[1]).norm(), 0, 1e-8);
}

TEST(DeviceDynamics, AHandTakesTheDeviceAlongAndGivesWayToAForce) {
  DeviceDynamics device({.encoder_mm = 0}, Vec3::Zero());
  for (int i = 0; i < 3000; ++i) device.advance(Vec3(0, -0.6, 0), Vec3(5, 0, 0));
  EXPECT_NEAR((device.tip() - Vec3(5, -2, 0)).norm(), 0, 1e-6);  // 0.6 N against 0.3 N/mm
}

TEST(DeviceDynamics, EncodersReadWholeSteps) {
  DeviceDynamics device({.encoder_mm = 0.05}, Vec3(0.12, -0.13, 1.0249));
  EXPECT_NEAR((device.measured_tip() - Vec3(0.1, -0.15, 1.0)).norm(), 0, 1e-12);
  EXPECT_EQ(device.tip(), Vec3(0.12, -0.13, 1.0249));
}

}  // namespace
}  // namespace brachy
