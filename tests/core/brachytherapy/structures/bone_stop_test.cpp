#include "core/brachytherapy/structures/bone_stop.h"

#include <gtest/gtest.h>

#include <cmath>

namespace brachy {
namespace {

constexpr double kStiffness = 20, kLength = 200, kMaxJump = 10;

/// Half a space of bone in front: its lower face at z = 0.
std::vector<TestedOrgan> bone() {
  SurfaceMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back({i & 1 ? 30.0 : -30.0, i & 2 ? 30.0 : -30.0, i & 4 ? 10.0 : 0.0});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return tested_organs({{TestedOrgan::kBone, mesh}});
}

RigidTransform at(double x, double z) {
  return {Mat3::Identity(), Vec3(x, 0, z)};
}

Vec3 held(BoneStop& stop, double x, double z) {
  return stop.hold(at(x, z), Vec3::Zero()).p;
}

TEST(BoneStop, TheTipStaysAtTheSurfaceAndTheForceRisesByItsLaw) {
  const auto organs = bone();
  BoneStop stop(organs, kStiffness, kLength, kMaxJump);
  EXPECT_EQ(held(stop, 0, -2), Vec3(0, 0, -2));
  EXPECT_FALSE(stop.is_stopped());
  EXPECT_EQ(stop.force_n(), 0);
  double last_n = 0;
  for (double z = 0.5; z < 4; z += 0.5) {
    EXPECT_NEAR(held(stop, 0, z).z(), 0, 2 * BoneStop::kClearanceMm) << z;
    EXPECT_NEAR(stop.force_n(), kStiffness * z, 0.03) << z;
    EXPECT_GT(stop.force_n(), last_n);
    last_n = stop.force_n();
  }
}

// Also where a tick's way is longer than the bone is thick.
TEST(BoneStop, NoSpeedBringsTheTipThrough) {
  const auto organs = bone();
  for (const double way : {0.3, 2.0, 9.0}) {
    BoneStop stop(organs, kStiffness, kLength, kMaxJump);
    for (double z = -5; z < 60; z += way) EXPECT_LE(held(stop, 0, z).z(), 0) << way << " " << z;
    EXPECT_EQ(stop.force_n(), BoneStop::kLargestN);
  }
}

TEST(BoneStop, TheTipSlidesAlongTheBoneAndLeavesItWhereTheHandGoesBack) {
  const auto organs = bone();
  BoneStop stop(organs, kStiffness, kLength, kMaxJump);
  held(stop, 0, -1);
  held(stop, 0, 1);
  const Vec3 aside = held(stop, 3, 1);
  EXPECT_NEAR(aside.x(), 3, 1e-12);
  EXPECT_NEAR(aside.z(), 0, 2 * BoneStop::kClearanceMm);
  EXPECT_EQ(held(stop, 3, -0.5), Vec3(3, 0, -0.5));
  EXPECT_FALSE(stop.is_stopped());
  EXPECT_EQ(stop.force_n(), 0);
}

TEST(BoneStop, ANeedleWithoutBoneInItsWayIsAsItWas) {
  const auto organs = bone();
  BoneStop stop(organs, kStiffness, kLength, kMaxJump);
  for (double z = -20; z < 30; z += 1) EXPECT_EQ(held(stop, 40, z), Vec3(40, 0, z));
}

TEST(BoneStop, ItsForceAndItsModelAgreeAtTheHandsPose) {
  const auto organs = bone();
  BoneStop stop(organs, kStiffness, kLength, kMaxJump);
  held(stop, 0, -1);
  held(stop, 0, 0.25);
  NeedleForces forces;
  forces.axial_n = forces.friction_n = 2;
  forces.force_n = {0, 0, -2};
  LocalContactModel model;
  model.reference_tip = {0, 0, 0};
  stop.add_to(forces, model);
  EXPECT_NEAR(forces.axial_n, 2 + kStiffness * 0.25, 0.03);
  EXPECT_NEAR(forces.axial_n, forces.cutting_n + forces.friction_n, 1e-12);
  EXPECT_NEAR(forces.force_n.z(), -forces.axial_n, 1e-12);
  EXPECT_TRUE(model.in_contact);
  EXPECT_NEAR(model.reference_tip.z(), 0.25, 2 * BoneStop::kClearanceMm);
  EXPECT_NEAR(model.axial_stiffness_n_per_mm * (model.reference_tip - model.contact_point).dot(model.axis),
              forces.axial_n, 1e-9);
}

}  // namespace
}  // namespace brachy
