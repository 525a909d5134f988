#include "core/contact/needle_contact.h"

#include <gtest/gtest.h>

#include "core/surface/surface_check.h"
#include "core/tissue/phantom.h"
#include "tests/core/rbf/random_landmarks.h"
#include "tests/core/sim/phantom_scene.h"

namespace brachy {
namespace {

using test::pose_at;
using test::straight;

class Contact : public ::testing::Test {
 protected:
  // The tip goes along `points`, the shaft along `axis`; nothing has been solved, so new landmarks start at rest.
  void drive(const std::vector<Vec3>& points, const Vec3& axis) {
    for (const Vec3& tip : points) contact.update(pose_at(tip, axis), nullptr);
  }
  void drive(const Vec3& from, const Vec3& to, double step = 0.2) {
    drive(straight(from, to, step), Vec3::UnitZ());
  }

  SurfaceBvh surface{prepare_surface(prostate_phantom(), {}, "phantom").mesh};
  ContactSettings settings;
  NeedleContact contact{surface, NeedleSettings{}, settings};
  const Vec3 below{8, -4, -40};
  const Vec3 entry = surface.first_hit(below, {8, -4, 40})->point;
  Vec3 at_depth(double mm) const { return entry + mm * Vec3::UnitZ(); }
};

TEST_F(Contact, IsFreeWithoutLandmarksBeforeTheSurface) {
  drive(below, at_depth(-0.01));
  EXPECT_EQ(contact.state(), ContactState::kFree);
  EXPECT_TRUE(contact.positions().empty());
  EXPECT_EQ(contact.load(), 0);
}

TEST_F(Contact, TouchingIsOneLandmarkFromTheFirstCollisionToTheTip) {
  drive(below, at_depth(2));
  EXPECT_EQ(contact.state(), ContactState::kTouching);
  ASSERT_EQ(contact.positions().size(), 1u);
  EXPECT_LT((contact.positions()[0] - entry).norm(), 1e-9);
  EXPECT_LT((contact.displacements()[0] - Vec3(0, 0, 2)).norm(), 1e-9);
  EXPECT_NEAR(contact.load(), 2 / settings.puncture_indentation_mm, 1e-9);
  EXPECT_EQ(contact.puncture_count(), 0u);
}

TEST_F(Contact, PullingBackFromTheIntactCapsuleFreesIt) {
  drive(below, at_depth(2));
  drive(at_depth(2), at_depth(-0.1));
  EXPECT_EQ(contact.state(), ContactState::kFree);
  EXPECT_TRUE(contact.positions().empty());
}

TEST_F(Contact, ThePointOfContactSlidesOnceDraggedTooFar) {
  const Vec3 apex = surface.first_hit({0, -2, -40}, {0, -2, 40})->point, pressed = apex + 2 * Vec3::UnitZ();
  drive({0, -2, -40}, pressed);
  drive(pressed, pressed + Vec3(5, 0, 0));
  ASSERT_EQ(contact.state(), ContactState::kTouching);
  const Vec3 p = contact.positions()[0], d = contact.displacements()[0];
  EXPECT_GT((p - apex).norm(), 2);
  EXPECT_NEAR(surface.closest_point(p).signed_distance, 0, 1e-9);
  const Vec3 n = surface.closest_point(p).normal;
  EXPECT_LT((d - d.dot(n) * n).norm(), settings.surface_slip_mm + 0.3);
}

TEST_F(Contact, TheCapsuleIsPuncturedAtItsIndentationAndSpringsBack) {
  drive(below, at_depth(settings.puncture_indentation_mm - 0.01));
  ASSERT_EQ(contact.state(), ContactState::kTouching);
  drive(at_depth(settings.puncture_indentation_mm), at_depth(settings.puncture_indentation_mm + 0.01));
  EXPECT_EQ(contact.state(), ContactState::kInserted);
  EXPECT_EQ(contact.puncture_count(), 1u);
  ASSERT_EQ(contact.displacements().size(), 1u);
  EXPECT_NEAR(contact.displacements().back().norm(), settings.cutting_displacement_mm, 1e-9);
}

TEST_F(Contact, LandmarksStandAtMaterialPointsAlongTheCutPath) {
  drive(below, at_depth(30));
  ASSERT_EQ(contact.state(), ContactState::kInserted);
  EXPECT_NEAR(contact.insertion_depth(), 30 - settings.cutting_displacement_mm, 1e-6);
  // Entry, then every 5 mm while the tip is half a spacing past: 0, 5, 10, 15, 20, 25; and the tip itself.
  ASSERT_EQ(contact.positions().size(), 7u);
  for (int k = 0; k < 6; ++k) EXPECT_LT((contact.positions()[k] - at_depth(5 * k)).norm(), 1e-6) << k;
  for (const Vec3& d : contact.displacements()) {
    EXPECT_NEAR(d.x(), 0, 1e-9);  // straight: nothing is pushed aside
    EXPECT_LE(d.z(), settings.cutting_displacement_mm + 1e-9);
  }
  for (int k = 0; k < 6; ++k) EXPECT_LE(contact.displacements()[k].z(), settings.friction_displacement_mm);
}

TEST_F(Contact, SidewaysTheTissueFollowsTheShaft) {
  drive(below, at_depth(30));
  drive(straight(at_depth(30), at_depth(30) + Vec3(2, 1, 0), 0.1), Vec3::UnitZ());
  for (std::size_t i = 0; i < contact.positions().size(); ++i) {
    const Vec3 carried = contact.positions()[i] + contact.displacements()[i];
    EXPECT_NEAR(carried.x(), entry.x() + 2, 1e-9);
    EXPECT_NEAR(carried.y(), entry.y() + 1, 1e-9);
  }
}

TEST_F(Contact, FrictionReversesWhenTheNeedleIsPulledBack) {
  drive(below, at_depth(30));
  drive(at_depth(30), at_depth(27));
  for (std::size_t i = 0; i + 1 < contact.displacements().size(); ++i)
    EXPECT_NEAR(contact.displacements()[i].z(), -settings.friction_displacement_mm, 1e-9);
  EXPECT_NEAR(contact.displacements().back().z(), 0, 1e-9);  // a tip does not pull
}

TEST_F(Contact, GoingForwardInTheOldPathCutsNothing) {
  drive(below, at_depth(30));
  const double depth = contact.insertion_depth();
  drive(at_depth(30), at_depth(15));
  EXPECT_NEAR(contact.insertion_depth(), 15, 1e-6);
  drive(at_depth(15), at_depth(25));
  EXPECT_NEAR(contact.displacements().back().z(), 0, 1e-6);
  drive(at_depth(25), at_depth(30));
  EXPECT_NEAR(contact.insertion_depth(), depth, 1e-6);
  EXPECT_EQ(contact.puncture_count(), 1u);
}

TEST_F(Contact, WithdrawalReleasesEveryLandmark) {
  drive(below, at_depth(30));
  drive(at_depth(30), below, 0.3);
  EXPECT_EQ(contact.state(), ContactState::kWithdrawn);
  EXPECT_TRUE(contact.positions().empty());
  EXPECT_EQ(contact.insertion_depth(), 0);
  drive(below, at_depth(1));
  EXPECT_EQ(contact.state(), ContactState::kTouching);  // and it can touch again
}

TEST_F(Contact, TheTipLeavesThroughTheFarSideAndComesBack) {
  drive(below, {8, -4, 40});
  EXPECT_EQ(contact.state(), ContactState::kThrough);
  const Vec3 exit = surface.first_hit({8, -4, 0}, {8, -4, 40})->point;
  EXPECT_NEAR(contact.insertion_depth(), (exit - entry).norm(), 0.01);
  for (const Vec3& p : contact.positions()) EXPECT_TRUE(surface.inside(p) || (p - entry).norm() < 1e-6);
  drive({8, -4, 40}, {8, -4, 5});
  EXPECT_EQ(contact.state(), ContactState::kInserted);
  drive({8, -4, 5}, below);
  EXPECT_EQ(contact.state(), ContactState::kWithdrawn);
  EXPECT_EQ(contact.puncture_count(), 1u);
}

// 12 to 28 cm/s at 200 Hz are 0.6 to 1.4 mm a tick (DESIGN §4): from every side and at every phase the surface stops
// the tip, and nothing is ever inside without contact.
TEST_F(Contact, NoTunnellingAtClinicalSpeeds) {
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 target = test::uniform_point(random, 8);
    const Vec3 axis = test::uniform_point(random, 1).normalized();
    const double step = test::uniform(random, 0.6, 1.4);
    NeedleContact needle(surface, NeedleSettings{}, settings);
    bool touched = false;
    for (double s = -60 + test::uniform(random, 0, step); s < 0; s += step) {
      const Vec3 tip = target + s * axis;
      needle.update(pose_at(tip, axis), nullptr);
      touched |= needle.state() == ContactState::kTouching;
      if (surface.inside(tip)) {
        ASSERT_NE(needle.state(), ContactState::kFree) << trial;
      }
    }
    ASSERT_EQ(needle.state(), ContactState::kInserted) << trial;
    ASSERT_TRUE(touched);
    ASSERT_EQ(needle.flags() & kStepReseated, 0u);
  }
}

TEST_F(Contact, TheShaftPressesSidewaysWithOneLandmark) {
  // The needle lies along z beside the gland, tip beyond its base, and moves in from the right.
  drive(straight({32, 0, 40}, {23, 0, 40}, 0.5), Vec3::UnitZ());
  ASSERT_EQ(contact.state(), ContactState::kTouching);
  ASSERT_EQ(contact.positions().size(), 1u);
  const Vec3 p = contact.positions()[0], d = contact.displacements()[0];
  EXPECT_NEAR(surface.closest_point(p).signed_distance, 0, 1e-9);
  EXPECT_NEAR((p + d).x(), 23, 1e-9);
  EXPECT_LT(d.x(), -0.5);
  drive(straight({23, 0, 40}, {32, 0, 40}, 0.5), Vec3::UnitZ());
  EXPECT_EQ(contact.state(), ContactState::kFree);
}

TEST_F(Contact, ANeedleThatStartsInsideIsSeatedWithoutDeformation) {
  drive(std::vector<Vec3>{at_depth(20)}, Vec3::UnitZ());
  EXPECT_EQ(contact.state(), ContactState::kInserted);
  EXPECT_NEAR(contact.insertion_depth(), 20, 1e-6);
  EXPECT_EQ(contact.positions().size(), 1u + 4u);  // 0, 5, 10, 15; tip
  for (const Vec3& d : contact.displacements()) EXPECT_LT(d.norm(), 1e-9);
}

TEST_F(Contact, AJumpSeatsTheNeedleAnewAndSaysSo) {
  drive(below, at_depth(20));
  contact.update(pose_at({-8, 3, 0}, Vec3::UnitZ()), nullptr);
  EXPECT_EQ(contact.flags() & kStepReseated, kStepReseated);
  EXPECT_EQ(contact.state(), ContactState::kInserted);
  for (const Vec3& d : contact.displacements()) EXPECT_LT(d.norm(), 1e-9);
  contact.update(pose_at({0, 0, 80}, -Vec3::UnitZ()), nullptr);
  EXPECT_EQ(contact.state(), ContactState::kWithdrawn);
}

TEST_F(Contact, DisplacementsAreHeldAtTheirLimitAndFlagged) {
  drive(below, at_depth(25));
  drive(straight(at_depth(25), at_depth(25) + Vec3(14, 0, 0), 0.2), Vec3::UnitZ());
  EXPECT_EQ(contact.flags() & kStepSaturated, kStepSaturated);
  for (const Vec3& d : contact.displacements()) EXPECT_LE(d.norm(), settings.max_displacement_mm + 1e-9);
}

// Whatever a hand does, the landmarks stay finite, apart, on or in the tissue, and within the declared number.
TEST_F(Contact, SurvivesAnyMotion) {
  std::mt19937_64 random(6);
  for (int run = 0; run < 50; ++run) {
    NeedleContact needle(surface, NeedleSettings{}, settings);
    Vec3 tip = test::uniform_point(random, 40), axis = Vec3::UnitZ(), velocity = Vec3::Zero();
    for (int tick = 0; tick < 2000; ++tick) {
      velocity = 0.98 * velocity + 0.05 * test::uniform_point(random, 1) - 0.0005 * tip;
      tip += velocity;
      axis = (axis + 0.01 * test::uniform_point(random, 1)).normalized();
      needle.update(pose_at(tip, axis), nullptr);
      const auto p = needle.positions();
      ASSERT_LE(p.size(), static_cast<std::size_t>(settings.max_landmarks));
      for (std::size_t i = 0; i < p.size(); ++i) {
        ASSERT_TRUE(p[i].allFinite() && needle.displacements()[i].allFinite());
        ASSERT_LT(surface.closest_point(p[i]).signed_distance, 2e-3) << run << " " << tick;
        for (std::size_t j = 0; j < i; ++j) ASSERT_GT((p[i] - p[j]).norm(), 0.1) << run << " " << tick;
      }
      if (surface.inside(tip)) {
        ASSERT_FALSE(p.empty() && needle.state() != ContactState::kThrough);
      }
    }
  }
}

}  // namespace
}  // namespace brachy
