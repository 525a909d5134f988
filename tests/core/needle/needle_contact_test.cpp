#include "core/needle/needle_contact.h"

#include <gtest/gtest.h>

#include "core/geometry/surface/surface_check.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

using test::pose_at;
using test::straight;

// Every landmark is on its own spring, so that NeedleContact is tested without a field.
struct Contact : ::testing::Test {
  static constexpr double kSpring = 0.75;  // N/mm

  void step(NeedleContact& needle, const RigidTransform& X_WN) {
    needle.begin(X_WN, nullptr);
    do {
      for (NeedleLandmark& landmark : needle.landmarks()) {
        const double stuck = kSpring * landmark.if_stuck.dot(needle.axis());
        const double axial = std::clamp(stuck, landmark.low_n, landmark.high_n);
        landmark.slip_mm = (stuck - axial) / kSpring;
        landmark.reaction_n = kSpring * landmark.if_stuck + (axial - stuck) * needle.axis();
      }
    } while (needle.reaches_uncut_tissue());
    const double stiffness = kSpring * static_cast<double>(needle.landmarks().size());
    needle.finish(++tick, 1.0 / 200, stiffness, stiffness);
  }
  // The tip goes along `points`, the shaft along `axis`.
  void drive(const std::vector<Vec3>& points, const Vec3& axis) {
    for (const Vec3& tip : points) step(contact, pose_at(tip, axis));
  }
  void drive(const Vec3& from, const Vec3& to, double step = 0.2) {
    drive(straight(from, to, step), Vec3::UnitZ());
  }
  Vec3 displacement(std::size_t i) const {
    const NeedleLandmark& landmark = contact.landmarks()[i];
    return landmark.if_stuck - landmark.slip_mm * contact.axis();
  }
  std::size_t count() const { return contact.landmarks().size(); }
  double axial() const { return contact.forces().axial_n; }

  SurfaceBvh surface{prepare_surface(prostate_phantom(), {}, "phantom").mesh};
  TissueContact tissue;
  NeedleTissues tissues{tissue, {}, 1.27};
  ContactSettings settings;
  NeedleContact contact{surface, tissues, NeedleSettings{}, settings};
  std::uint64_t tick = 0;
  const Vec3 below{8, -4, -40};
  const Vec3 entry = surface.first_hit(below, {8, -4, 40})->point;
  Vec3 at_depth(double mm) const { return entry + mm * Vec3::UnitZ(); }
};

TEST_F(Contact, IsFreeWithoutLandmarksBeforeTheSurface) {
  drive(below, at_depth(-0.01));
  EXPECT_EQ(contact.state(), ContactState::kFree);
  EXPECT_EQ(count(), 0u);
  EXPECT_EQ(contact.load(), 0);
  EXPECT_EQ(contact.forces(), NeedleForces{});
}

TEST_F(Contact, ADeviceIsToldOfTheCapsuleAhead) {
  drive(below, at_depth(-10));
  const LocalContactModel& m = contact.local_model();
  EXPECT_FALSE(m.in_contact);
  EXPECT_TRUE(m.is_capsule);
  EXPECT_LT((m.contact_point - entry).norm(), 1e-9);
  EXPECT_EQ(m.axial_min_n, 0);
  EXPECT_EQ(m.axial_max_n, tissue.puncture_force_n);
}

TEST_F(Contact, TouchingIsOneLandmarkFromTheFirstCollisionToTheTip) {
  drive(below, at_depth(2));
  EXPECT_EQ(contact.state(), ContactState::kTouching);
  ASSERT_EQ(count(), 1u);
  EXPECT_LT((contact.landmarks()[0].position - entry).norm(), 1e-9);
  EXPECT_LT((contact.landmarks()[0].if_stuck - Vec3(0, 0, 2)).norm(), 1e-9);
  // The capsule's law at 2 mm says how stiff the tissue is.
  EXPECT_EQ(contact.landmarks()[0].spread.core_mm, 0);
  EXPECT_NEAR(contact.landmarks()[0].spread.stiffness_n_per_mm, 0.3 + 0.06 * 2, 1e-9);
  EXPECT_EQ(contact.landmarks()[0].spread.axis, Vec3(0, 0, 1));
  EXPECT_NEAR(axial(), 2 * 0.3 + 4 * 0.06, 1e-6);  // the capsule's curve, which is less than the spring's
  EXPECT_NEAR(contact.load(), axial() / tissue.puncture_force_n, 1e-12);
  EXPECT_EQ(contact.puncture_count(), 0u);
}

TEST_F(Contact, PullingBackFromTheIntactCapsuleFreesIt) {
  drive(below, at_depth(2));
  drive(at_depth(2), at_depth(-0.1));
  EXPECT_EQ(contact.state(), ContactState::kFree);
  EXPECT_EQ(count(), 0u);
}

TEST_F(Contact, ThePointOfContactSlidesOnceDraggedTooFar) {
  const Vec3 apex = surface.first_hit({0, -2, -40}, {0, -2, 40})->point, pressed = apex + 2 * Vec3::UnitZ();
  drive({0, -2, -40}, pressed);
  drive(pressed, pressed + Vec3(5, 0, 0));
  ASSERT_EQ(contact.state(), ContactState::kTouching);
  const Vec3 p = contact.landmarks()[0].position, d = contact.landmarks()[0].if_stuck;
  EXPECT_GT((p - apex).norm(), 2);
  EXPECT_NEAR(surface.closest_point(p).signed_distance, 0, 1e-9);
  EXPECT_LT(std::hypot(d.x(), d.y()), settings.surface_slip_mm + 0.3);
}

TEST_F(Contact, TheCapsuleIsPuncturedAtItsForceWhichThenDropsToTheCuttingForce) {
  const double indentation = (-0.3 + std::sqrt(0.09 + 4 * 0.06 * 5.6)) / 0.12;  // a₁δ + a₂δ² = 5.6 N
  drive(below, at_depth(indentation - 0.01));
  ASSERT_EQ(contact.state(), ContactState::kTouching);
  EXPECT_LT(axial(), 5.6);
  EXPECT_EQ(contact.puncture_count(), 0u);
  drive(std::vector<Vec3>{at_depth(indentation + 0.01)}, Vec3::UnitZ());
  EXPECT_NEAR(axial(), 5.6, 1e-9);
  EXPECT_EQ(contact.puncture_count(), 1u);
  drive(std::vector<Vec3>{at_depth(indentation + 0.02)}, Vec3::UnitZ());
  EXPECT_EQ(contact.state(), ContactState::kInserted);
  ASSERT_EQ(count(), 1u);
  EXPECT_NEAR(axial(), 3, 1e-9);
  EXPECT_NEAR(displacement(0).z(), 3 / kSpring, 1e-9);
}

TEST_F(Contact, ASurfaceWithoutACapsuleOpensAtOnce) {
  TissueContact open = tissue;
  open.puncture_force_n = 0;
  const NeedleTissues soft{open, {}, 1.27};
  NeedleContact needle(surface, soft, NeedleSettings{}, settings);
  for (const Vec3& tip : straight(below, at_depth(1), 0.2)) step(needle, pose_at(tip, Vec3::UnitZ()));
  EXPECT_EQ(needle.state(), ContactState::kInserted);
}

TEST_F(Contact, AThickerNeedleMeetsMore) {
  const NeedleTissues thick{tissue, {}, 2 * 1.27};
  EXPECT_EQ(thick[0].puncture_force_n, 2 * tissue.puncture_force_n);
  EXPECT_EQ(thick[0].friction_n_per_mm, 2 * tissue.friction_n_per_mm);
}

TEST_F(Contact, LandmarksStandAtMaterialPointsAlongTheCutPath) {
  drive(below, at_depth(30));
  ASSERT_EQ(contact.state(), ContactState::kInserted);
  // The tip's own spring takes cutting and a share of friction; that far its material point is behind.
  EXPECT_NEAR(contact.insertion_depth(), 30 - 3 / kSpring, 0.3);
  // Entry, then every 5 mm while the tip is half a spacing past: 0, 5, 10, 15, 20; and the tip itself.
  ASSERT_EQ(count(), 6u);
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_LT((contact.landmarks()[k].position - at_depth(5 * static_cast<double>(k))).norm(), 1e-6) << k;
    EXPECT_NEAR(displacement(k).x(), 0, 1e-9);  // straight: no lateral displacement
  }
}

// Friction along the shaft grows smoothly with the length in the tissue: adding a landmark causes no step.
TEST_F(Contact, FrictionGrowsSmoothlyWithTheLengthInserted) {
  drive(below, at_depth(12));
  double last = 0, last_depth = contact.insertion_depth();
  for (const Vec3& tip : straight(at_depth(12), at_depth(36), 0.05)) {
    step(contact, pose_at(tip, Vec3::UnitZ()));
    double friction = 0;
    for (const NeedleLandmark& landmark : contact.landmarks()) friction += landmark.friction_n;
    ASSERT_NEAR(friction, 0.02 * last_depth, 1e-9);
    if (last > 0) {
      ASSERT_NEAR(axial() - last, 0.02 * (contact.insertion_depth() - last_depth), 0.01);
    }
    last = axial();
    last_depth = contact.insertion_depth();
  }
  EXPECT_NEAR(axial(), 3 + 0.02 * contact.insertion_depth(), 0.05);
  EXPECT_NEAR(contact.forces().cutting_n, 3, 1e-9);
}

TEST_F(Contact, SidewaysTheTissueFollowsTheShaft) {
  drive(below, at_depth(30));
  drive(straight(at_depth(30), at_depth(30) + Vec3(2, 1, 0), 0.1), Vec3::UnitZ());
  for (std::size_t i = 0; i < count(); ++i) {
    const Vec3 carried = contact.landmarks()[i].position + displacement(i);
    EXPECT_NEAR(carried.x(), entry.x() + 2, 1e-9);
    EXPECT_NEAR(carried.y(), entry.y() + 1, 1e-9);
  }
  EXPECT_NEAR(contact.forces().lateral_n, kSpring * std::hypot(2, 1) * static_cast<double>(count()), 1e-9);
}

TEST_F(Contact, FrictionReversesWhenTheNeedleIsPulledBackAndTheTipDoesNotPull) {
  drive(below, at_depth(30));
  EXPECT_GT(axial(), 3);
  drive(at_depth(30), at_depth(22));
  EXPECT_NEAR(axial(), -0.02 * contact.insertion_depth(), 0.03);
  EXPECT_EQ(contact.forces().cutting_n, 0);
}

TEST_F(Contact, GoingForwardInTheOldPathCutsNothing) {
  drive(below, at_depth(30));
  const double depth = contact.insertion_depth();
  drive(at_depth(30), at_depth(15));
  EXPECT_NEAR(contact.insertion_depth(), 15, 0.3);
  drive(at_depth(15), at_depth(24));
  EXPECT_EQ(contact.forces().cutting_n, 0);
  EXPECT_NEAR(axial(), 0.02 * contact.insertion_depth(), 0.03);
  drive(at_depth(24), at_depth(30));
  EXPECT_NEAR(contact.forces().cutting_n, 3, 0.01);
  EXPECT_NEAR(contact.insertion_depth(), depth, 0.02);
  EXPECT_EQ(contact.puncture_count(), 1u);
}

TEST_F(Contact, TheEndOfTheOldPathIsMetInTheTickThatReachesIt) {
  drive(below, at_depth(30));
  const double depth = contact.insertion_depth();
  drive(at_depth(30), at_depth(20));
  drive(std::vector<Vec3>{at_depth(29)},
        Vec3::UnitZ());  // 9 mm in one tick, 2.6 mm more than the cut is long
  EXPECT_GT(contact.forces().cutting_n, 1);
  EXPECT_LE(contact.forces().cutting_n, 3 + 1e-9);
  EXPECT_LE(contact.insertion_depth(), depth);
}

TEST_F(Contact, WithdrawalReleasesEveryLandmark) {
  drive(below, at_depth(30));
  drive(at_depth(30), below, 0.3);
  EXPECT_EQ(contact.state(), ContactState::kWithdrawn);
  EXPECT_EQ(count(), 0u);
  EXPECT_EQ(contact.insertion_depth(), 0);
  EXPECT_EQ(contact.forces(), NeedleForces{});
}

TEST_F(Contact, InAgainAtTheSamePlaceItFollowsItsOldCut) {
  drive(below, at_depth(30));
  const double depth = contact.insertion_depth();
  drive(at_depth(30), below, 0.3);
  drive(below, at_depth(-5));
  EXPECT_EQ(contact.local_model().axial_max_n, 0);  // the capsule ahead has a hole
  drive(at_depth(-5), at_depth(20));
  EXPECT_EQ(contact.state(), ContactState::kInserted);
  EXPECT_EQ(contact.puncture_count(), 1u);
  EXPECT_LT(axial(), 0.02 * 20 + 0.05);
  drive(at_depth(20), at_depth(32));
  EXPECT_NEAR(contact.forces().cutting_n, 3, 1e-9);
  EXPECT_GT(contact.insertion_depth(), depth);
}

TEST_F(Contact, InAgainElsewhereItMeetsTheCapsule) {
  drive(below, at_depth(30));
  drive(at_depth(30), below, 0.3);
  const Vec3 beside(3, 0, 0);
  drive(below + beside, at_depth(1) + beside);
  drive(straight(at_depth(1) + beside, at_depth(4) + beside, 0.2), Vec3::UnitZ());
  EXPECT_EQ(contact.state(), ContactState::kTouching);
}

TEST_F(Contact, ATipBesideItsOldCutCutsANewOne) {
  drive(below, at_depth(30));
  drive(at_depth(30), at_depth(15));
  const Vec3 aside(2.5, 0, 0);
  drive(straight(at_depth(15), at_depth(15) + aside, 0.1), Vec3::UnitZ());
  drive(at_depth(15) + aside, at_depth(22) + aside);
  EXPECT_NEAR(contact.forces().cutting_n, 3, 1e-9);
}

TEST_F(Contact, AGlandWithACapsuleOfItsOwnHoldsTheTipUpToItsPunctureForce) {
  TissueContact gland = tissue;
  gland.cutting_force_n = 2;
  const NeedleTissues layered{
      tissue, {{std::make_shared<EllipsoidRegion>(Vec3(8, -4, 5), Vec3::Constant(10), 1), gland}}, 1.27};
  NeedleContact needle(surface, layered, NeedleSettings{}, settings);
  double largest_before = 0, largest_at = 0, after = 0;
  for (const Vec3& tip : straight(below, {8, -4, 12}, 0.05)) {
    step(needle, pose_at(tip, Vec3::UnitZ()));
    const double depth_z = entry.z() + needle.insertion_depth();
    if (needle.puncture_count() == 1 && depth_z < -5.1) largest_before = needle.forces().axial_n;
    if (needle.puncture_count() >= 1 && depth_z > -5.1 && depth_z < -4.9)
      largest_at = std::max(largest_at, needle.forces().axial_n);
    after = needle.forces().cutting_n;
  }
  EXPECT_EQ(needle.puncture_count(), 2u);
  EXPECT_NEAR(largest_before, 3 + 0.02 * 12, 0.2);
  EXPECT_NEAR(largest_at, 5.6 + 0.02 * 17, 0.3);
  EXPECT_NEAR(after, 2, 1e-9);
}

TEST_F(Contact, TheTipLeavesThroughTheFarSideAndComesBack) {
  drive(below, {8, -4, 40});
  EXPECT_EQ(contact.state(), ContactState::kThrough);
  const Vec3 exit = surface.first_hit({8, -4, 0}, {8, -4, 40})->point;
  EXPECT_NEAR(contact.insertion_depth(), (exit - entry).norm(), 0.01);
  for (const NeedleLandmark& landmark : contact.landmarks()) {
    EXPECT_TRUE(surface.inside(landmark.position) || (landmark.position - entry).norm() < 1e-6);
  }
  drive({8, -4, 40}, {8, -4, 5});
  EXPECT_EQ(contact.state(), ContactState::kInserted);
  drive({8, -4, 5}, below);
  EXPECT_EQ(contact.state(), ContactState::kWithdrawn);
  EXPECT_EQ(contact.puncture_count(), 1u);
}

// 12 to 28 cm/s at 200 Hz are 0.6 to 1.4 mm a tick (core/DESIGN.md, section 4): from every side and at every
// phase the surface stops the tip, and nothing is ever inside without contact.
TEST_F(Contact, NoTunnellingAtClinicalSpeeds) {
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 target = test::uniform_point(random, 8);
    const Vec3 axis = test::uniform_point(random, 1).normalized();
    const double stride = test::uniform(random, 0.6, 1.4);
    NeedleContact needle(surface, tissues, NeedleSettings{}, settings);
    bool touched = false;
    for (double s = -60 + test::uniform(random, 0, stride); s < 10; s += stride) {
      const Vec3 tip = target + s * axis;
      step(needle, pose_at(tip, axis));
      touched |= needle.state() == ContactState::kTouching;
      if (surface.inside(tip)) {
        ASSERT_NE(needle.state(), ContactState::kFree) << trial;
      }
    }
    ASSERT_EQ(needle.state(), ContactState::kInserted) << trial;
    ASSERT_TRUE(touched);
    ASSERT_EQ(needle.flags() & kStepReinitialized, 0u);
  }
}

TEST_F(Contact, TheShaftPressesSidewaysAlongALine) {
  // The needle lies along z beside the gland, tip beyond its base, and moves in from the right.
  drive(straight({32, 0, 40}, {23, 0, 40}, 0.5), Vec3::UnitZ());
  ASSERT_EQ(contact.state(), ContactState::kTouching);
  ASSERT_GT(count(), 3u);
  const double edge = 23 - 0.5 * 1.27;  // the needle's leading one
  double deepest = 0;
  for (const NeedleLandmark& landmark : contact.landmarks()) {
    const Vec3 &p = landmark.position, &d = landmark.if_stuck;
    EXPECT_NEAR(surface.closest_point(p).signed_distance, 0, 1e-9);
    EXPECT_LT((d - d.dot(landmark.axis) * landmark.axis).norm(), 1e-9);
    EXPECT_NEAR(landmark.axis.z(), 0, 1e-9) << "across the needle";
    EXPECT_LT(landmark.axis.x(), -0.9);
    EXPECT_EQ(landmark.low_n, 0) << "pushed, not pulled";
    EXPECT_LT(p.y(), 25);
    EXPECT_GE((p + d).x(), edge - 1e-9) << "no farther than the needle";
    deepest = std::max(deepest, d.norm());
  }
  EXPECT_GT(deepest, 0.5);
  drive(straight({23, 0, 40}, {32, 0, 40}, 0.5), Vec3::UnitZ());
  EXPECT_EQ(contact.state(), ContactState::kFree);
}

TEST_F(Contact, ANeedleThatStartsInsideIsInitializedWithoutDeformation) {
  drive(std::vector<Vec3>{at_depth(20)}, Vec3::UnitZ());
  EXPECT_EQ(contact.state(), ContactState::kInserted);
  EXPECT_NEAR(contact.insertion_depth(), 20, 1e-6);
  EXPECT_EQ(count(), 1u + 4u);  // 0, 5, 10, 15; tip
  for (std::size_t i = 0; i < count(); ++i) EXPECT_LT(displacement(i).norm(), 1e-9);
  EXPECT_LT(contact.forces().force_n.norm(), 1e-9);
}

TEST_F(Contact, AJumpReinitializesTheNeedleAndSaysSo) {
  drive(below, at_depth(20));
  step(contact, pose_at({-8, 3, 0}, Vec3::UnitZ()));
  EXPECT_EQ(contact.flags() & kStepReinitialized, kStepReinitialized);
  EXPECT_EQ(contact.state(), ContactState::kInserted);
  for (std::size_t i = 0; i < count(); ++i) EXPECT_LT(displacement(i).norm(), 1e-9);
  step(contact, pose_at({0, 0, 80}, -Vec3::UnitZ()));
  EXPECT_EQ(contact.state(), ContactState::kWithdrawn);
}

TEST_F(Contact, DisplacementsAreHeldAtTheirLimitAndFlagged) {
  drive(below, at_depth(25));
  drive(straight(at_depth(25), at_depth(25) + Vec3(20, 0, 0), 0.2), Vec3::UnitZ());
  EXPECT_EQ(contact.flags() & kStepSaturated, kStepSaturated);
  for (std::size_t i = 0; i < count(); ++i)
    EXPECT_LE(displacement(i).x(), settings.max_displacement_mm + 1e-9);
}

// For random motion the landmarks stay finite, apart, on or in the tissue, and within the declared number.
TEST_F(Contact, SurvivesAnyMotion) {
  std::mt19937_64 random(6);
  for (int run = 0; run < 50; ++run) {
    NeedleContact needle(surface, tissues, NeedleSettings{}, settings);
    Vec3 tip = test::uniform_point(random, 40), axis = Vec3::UnitZ(), velocity = Vec3::Zero();
    for (int k = 0; k < 2000; ++k) {
      velocity = 0.98 * velocity + 0.05 * test::uniform_point(random, 1) - 0.0005 * tip;
      tip += velocity;
      axis = (axis + 0.01 * test::uniform_point(random, 1)).normalized();
      step(needle, pose_at(tip, axis));
      const auto landmarks = needle.landmarks();
      ASSERT_LE(landmarks.size(), static_cast<std::size_t>(settings.max_landmarks));
      for (std::size_t i = 0; i < landmarks.size(); ++i) {
        const Vec3& p = landmarks[i].position;
        ASSERT_TRUE(p.allFinite() && landmarks[i].if_stuck.allFinite());
        ASSERT_LE(landmarks[i].low_n, landmarks[i].high_n);
        ASSERT_LT(surface.closest_point(p).signed_distance, 2e-3) << run << " " << k;
        for (std::size_t j = 0; j < i; ++j)
          ASSERT_GT((p - landmarks[j].position).norm(), 0.1) << run << " " << k;
      }
      ASSERT_TRUE(needle.forces().force_n.allFinite());
      ASSERT_NEAR(needle.forces().axial_n, needle.forces().cutting_n + needle.forces().friction_n, 1e-9);
      if (surface.inside(tip)) {
        ASSERT_FALSE(landmarks.empty() && needle.state() != ContactState::kThrough);
      }
    }
  }
}

}  // namespace
}  // namespace brachy
