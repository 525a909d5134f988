#include "haptics/force/negotiation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace brachy {
namespace {

TEST(Negotiation, StiffnessIsTwoBOverTPlusTwoTau) {  // figures of core/DESIGN.md, section 4, N/m
  const double b = 0.0005;
  EXPECT_NEAR(1000 * passive_stiffness_n_per_mm(b, {.period_s = 0.001, .delay_s = 0}), 1000, 1e-9);
  EXPECT_NEAR(1000 * passive_stiffness_n_per_mm(b, {.period_s = 0.005, .delay_s = 0}), 200, 1e-9);
  EXPECT_NEAR(1000 * passive_stiffness_n_per_mm(b, {.period_s = 0.005, .delay_s = 0.005}), 66.67, 0.01);
}

TEST(Negotiation, ADeviceThatStatesNothingIsATouchOfHalfANewtonSecond) {
  const ForceLimits limits = negotiate({}, {.period_s = 0.001, .delay_s = 0});
  EXPECT_EQ(limits.max_force_n, 3.3);
  EXPECT_NEAR(limits.max_stiffness_n_per_mm, 1, 1e-12);
}

TEST(Negotiation, TheDevicesOwnLimitHoldsWhereItIsLower) {
  const ClosedLoop loop{.period_s = 0.001, .delay_s = 0};
  EXPECT_EQ(negotiate({.max_force_n = 7.9, .max_stiffness_n_per_mm = 0.3}, loop).max_stiffness_n_per_mm, 0.3);
  EXPECT_EQ(negotiate({.max_force_n = 7.9, .max_stiffness_n_per_mm = 0.3}, loop).max_force_n, 7.9);
  EXPECT_NEAR(
      negotiate({.max_stiffness_n_per_mm = 30, .damping_n_s_per_mm = 0.001}, loop).max_stiffness_n_per_mm, 2,
      1e-12);
}

TEST(Negotiation, NonsenseIsAsIfNotStated) {
  const ForceLimits limits = negotiate(
      {.max_force_n = -1, .max_stiffness_n_per_mm = 0, .damping_n_s_per_mm = INFINITY}, {.period_s = 0.001});
  EXPECT_EQ(limits.max_force_n, 3.3);
  EXPECT_NEAR(limits.max_stiffness_n_per_mm, 1, 1e-12);
}

TEST(Negotiation, WhatIsNotPlausibleIsAsIfNotStated) {
  const ClosedLoop loop{.period_s = 0.001, .delay_s = 0};
  for (const double damping : {0.5, 1e9}) {  // N·s/m in place of N·s/mm, and nonsense
    EXPECT_NEAR(negotiate({.damping_n_s_per_mm = damping}, loop).max_stiffness_n_per_mm, 1, 1e-12);
    EXPECT_TRUE(is_implausible(damping, kLargestDampingNsPerMm));
  }
  EXPECT_EQ(negotiate({.max_force_n = 500}, loop).max_force_n, 3.3);
  EXPECT_EQ(negotiate({.max_force_n = 50}, loop).max_force_n, 50);
  EXPECT_NEAR(negotiate({.damping_n_s_per_mm = 0.05}, loop).max_stiffness_n_per_mm, 100, 1e-9);
  EXPECT_FALSE(is_implausible(NAN, kLargestForceN)) << "not stated";
}

}  // namespace
}  // namespace brachy
