// A needle in a hole of the template against closed forms of a cantilever (S. Timoshenko, Strength of Materials I).
#include <gtest/gtest.h>

#include "core/needle/needle_bend.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy {
namespace {

constexpr double kLength = 200, kTemplateZ = -60, kTipZ = 50;
constexpr double kArc = kLength - (kTipZ - kTemplateZ);  // of the hole, from the hub: 90 mm
const double kEI = Beam::bending_stiffness(200, 1.27, 1.0);

NeedleSettings settings(const char* guide_at) {
  NeedleSettings needle;
  needle.flexible = true;
  needle.inner_diameter_mm = 1.0;
  needle.guide_at = guide_at;
  return needle;
}

/// A needle along `axis` that has come through the template with its tip at `tip`, and is then moved by `aside`.
NeedleBend bent(const char* guide_at, const Vec3& aside, const Vec3& axis = Vec3::UnitZ(),
                double tip_force_n = 0) {
  NeedleBend bend(settings(guide_at), kTemplateZ, 4);
  const Vec3 tip = kTipZ * Vec3::UnitZ();
  for (double back = 130; back >= 0; back -= 5) {
    const RigidTransform X = test::pose_at(tip - back * axis, axis);
    bend.begin(X, X);
  }
  const RigidTransform X = test::pose_at(tip + aside, axis);
  bend.begin(X, X);
  NeedleLandmark at_tip;
  at_tip.axis = axis;
  at_tip.arc_mm = kLength;
  at_tip.reaction_n = -tip_force_n * axis.unitOrthogonal();
  if (tip_force_n != 0) bend.set_loads(std::span(&at_tip, 1));
  return bend;
}

TEST(NeedleBend, AHandThatMovesAsideIsPushedBackByAFixedHole) {
  const double g = 2, k = 3 * kEI / (kArc * kArc * kArc);
  const NeedleBend bend = bent("template", g * Vec3::UnitX());
  EXPECT_NEAR(bend.beam().guide_mm, kArc, 1e-9);
  EXPECT_NEAR(bend.deflection(kArc).x(), -g, 1e-9) << "the needle passes the hole";
  EXPECT_NEAR(bend.tip_deflection().x(), -g * (3 * kLength - kArc) / (2 * kArc), 1e-9);
  EXPECT_NEAR(bend.slope(kArc).x(), -1.5 * g / kArc, 1e-12);
  const Vec3 force = bend.guide_force_n();
  EXPECT_NEAR(force.x(), -k * g, 1e-9);
  EXPECT_NEAR(force.y(), 0, 1e-12);
  EXPECT_NEAR(force.z(), -1.5 * k * g * g / kArc, 1e-9)
      << "the bent needle slants in the hole, which pushes it out";
  EXPECT_NEAR(bend.stiffness_at_hole(), k, 1e-12);
  EXPECT_NEAR(bend.share_of_hand(kLength), 1 - (3 * kLength - kArc) / (2 * kArc), 1e-12);
}

// The force is the derivative of the energy that the bent needle stores, ½ k g², for motions in any direction.
TEST(NeedleBend, TheHolesForceIsTheDerivativeOfTheStoredEnergy) {
  const Vec3 axis = Vec3(0.1, -0.2, 1).normalized(), aside(1.5, 0.7, 0.4);
  const auto energy = [&](const Vec3& at) {
    const NeedleBend bend = bent("template", at, axis);
    const Vec3 g = bend.deflection(bend.beam().guide_mm);
    return 0.5 * bend.stiffness_at_hole() * g.squaredNorm();
  };
  const Vec3 force = bent("template", aside, axis).guide_force_n();
  for (int k = 0; k < 3; ++k) {
    const Vec3 step = 1e-4 * Vec3::Unit(k);
    const double slope = (energy(aside + step) - energy(aside - step)) / 2e-4;
    EXPECT_NEAR(force[k], -slope, 1e-3 * force.norm()) << k;
  }
}

TEST(NeedleBend, AHoleShiftsAForceAtTheTipToTheHand) {
  const double P = 0.1, share = (3 * kLength - kArc) / (2 * kArc);
  const double free = kLength * kLength * kLength / (3 * kEI);
  const double through = kArc * kArc * (3 * kLength - kArc) / (6 * kEI);
  const double held = P * (free - through * share);
  const Vec3 across = Vec3::UnitZ().unitOrthogonal();
  for (const char* guide_at : {"template", "hand"}) {
    const NeedleBend bend = bent(guide_at, Vec3::Zero(), Vec3::UnitZ(), P);
    EXPECT_NEAR(bend.tip_deflection().dot(across), held, 0.01 * held) << guide_at;
    EXPECT_NEAR(bend.deflection(kArc).norm(), 0, 1e-9) << guide_at;
  }
  EXPECT_NEAR(bent("template", Vec3::Zero(), Vec3::UnitZ(), P).guide_force_n().dot(across), -P * share,
              0.01 * P);
  // The hand carries the other hole: across the needle it feels all of P, the tissue's own force.
  EXPECT_NEAR(bent("hand", Vec3::Zero(), Vec3::UnitZ(), P).guide_force_n().dot(across), 0, 1e-12);
}

TEST(NeedleBend, AHoleThatGoesWithTheHandTakesNothingAside) {
  const NeedleBend bend = bent("hand", 3 * Vec3::UnitX());
  EXPECT_NEAR(bend.beam().guide_mm, kArc, 1e-9);
  EXPECT_EQ(bend.tip_deflection(), Vec3(Vec3::Zero()));
  EXPECT_EQ(bend.guide_force_n(), Vec3(Vec3::Zero()));
  EXPECT_EQ(bend.share_of_hand(kLength), 1);
}

TEST(NeedleBend, TheHoleIsLeftBehindTheTemplateAndAfterAJump) {
  NeedleBend bend(settings("template"), kTemplateZ, 4);
  const auto go = [&](const Vec3& tip) {
    const RigidTransform X = test::pose_at(tip, Vec3::UnitZ());
    bend.begin(X, X);
    return bend.guide_force_n().x();
  };
  go({0, 0, -50});
  EXPECT_LT(go({2, 0, -50}), -1e-3);
  EXPECT_EQ(go({2, 0, -65}), 0) << "drawn back through the template";
  EXPECT_EQ(go({2, 0, -50}), 0) << "and in through another hole";
  EXPECT_LT(go({4, 0, -50}), -1e-3);
  bend.leave_hole();
  EXPECT_EQ(go({4, 0, -50}), 0);
}

}  // namespace
}  // namespace brachy
