// What the hand feels of a needle in the template, in whole simulations: energy, the local model and the hole's part.
#include <gtest/gtest.h>

#include "haptics/force/local_force.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/sanitized.h"
#include "tests/scene_count.h"

namespace brachy {
namespace {

using test::needle_pose;
using test::pose_at;

Scene scene_of(const std::string& guide_at) {
  Scene scene;
  scene.tissue.points = 1500;
  if (guide_at == "rigid") return scene;
  scene.needle.flexible = true;
  scene.needle.inner_diameter_mm = 1.0;
  scene.needle.guide_at = guide_at;
  return scene;
}

class GuidedHand {
 public:
  explicit GuidedHand(const Scene& scene)
      : simulator_(load_simulation_model(scene, load_tissue(scene).tissue)) {}

  const NeedleState& step(const Vec3& tip, const Vec3& axis) {
    simulator_.step(needle_pose(pose_at(tip, axis)), state_);
    const NeedleState& needle = state_.needles.states[0];
    const Vec3 force = needle.forces.force_n;
    const double done = -0.5 * (force + last_force_).dot(tip - last_tip_);
    work += done;
    through += std::abs(done);
    last_force_ = force;
    last_tip_ = tip;
    LocalForce local;
    EXPECT_TRUE(local.take(needle.local_model, LocalForce::kUnknown, 0));
    std::uint32_t ignored = 0;
    off_local_n = std::max(off_local_n, (local.wanted(needle.X_WN.p, 0, 0, ignored) - force).norm());
    return needle;
  }
  const NeedleState& go(const Vec3& from, const Vec3& to, double stride, const Vec3& axis = Vec3::UnitZ()) {
    for (const Vec3& tip : test::straight(from, to, stride)) step(tip, axis);
    return state_.needles.states[0];
  }
  void begin(const Vec3& tip) {
    last_force_.setZero();
    last_tip_ = tip;
    work = through = 0;
  }
  const Vec3& last_force() const { return last_force_; }

  double work = 0, through = 0, off_local_n = 0;

 private:
  Simulator simulator_;
  MeshState state_ = simulator_.initial_state();
  Vec3 last_force_ = Vec3::Zero(), last_tip_ = Vec3::Zero();
};

class Guide : public ::testing::TestWithParam<const char*> {};

// Loops from outside the template to outside, with a hand that moves aside by millimetres within.
TEST_P(Guide, CreatesNoEnergyAndItsForceIsTheLocalModels) {
  std::mt19937_64 random(14);
  GuidedHand hand(scene_of(GetParam()));
  const int loops = test::kIsSanitized ? 2 : test::scene_count(12);
  for (int loop = 0; loop < loops; ++loop) {
    const Vec3 axis = (Vec3::UnitZ() + test::uniform_point(random, 0.15)).normalized();
    const Vec3 goal = test::uniform_point(random, 8), outside = goal - 75 * axis;
    const double aside = loop % 2 ? 4 : 1.5;
    std::vector<Vec3> points = {outside, goal - 30 * axis};
    for (int k = 0; k < 4; ++k)
      points.push_back(goal + test::uniform(random, -28, 8) * axis + test::uniform_point(random, aside));
    points.push_back(outside);
    hand.begin(outside);
    for (std::size_t p = 1; p < points.size(); ++p) hand.go(points[p - 1], points[p], 0.25, axis);
    EXPECT_GE(hand.work, -1e-3 * hand.through) << "loop " << loop;
    EXPECT_EQ(hand.last_force(), Vec3(Vec3::Zero())) << "loop " << loop;
  }
  EXPECT_LT(hand.off_local_n, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Simulation, Guide, testing::Values("rigid", "none", "template", "hand"),
                         [](const auto& guide) { return std::string(guide.param); });

// A hand that moves aside with 36 mm of the shaft in the gland is pushed back, whatever guides the needle.
TEST(GuideForce, PushesTheHandBack) {
  for (const char* guide_at : {"none", "template", "hand"}) {
    GuidedHand hand(scene_of(guide_at));
    const Vec3 in(0, 0, 14);
    hand.go({0, 0, -70}, in, 0.25);
    const double before = hand.last_force().x();
    double last = before;
    for (double aside = 0.25; aside <= 4; aside += 0.25) {
      const NeedleState& needle = hand.step(in + aside * Vec3::UnitX(), Vec3::UnitZ());
      EXPECT_LT(needle.forces.force_n.x(), last) << guide_at << " " << aside;
      last = needle.forces.force_n.x();
      // The stiffness that the device gets is that of the next step.
      const double stiffness = needle.local_model.lateral_stiffness_n_per_mm;
      EXPECT_GT(stiffness, 0) << guide_at;
    }
    EXPECT_LT(last, before - 0.01) << guide_at;
  }
}

// A needle that the hole turns towards the gland's side touches where it is: the force begins at nothing, there as well
// as on the pose's line. Its tip is 3 mm aside by then.
TEST(GuideForce, BeginsWhereTheTurnedNeedleTouches) {
  const Vec3 axis = Vec3(-0.03, -0.06, 1).normalized(), in(8, 10.9, -19), to(7, 10.8, -10.4);
  GuidedHand hand(scene_of("template"));
  hand.go(Vec3(-0.8, 15.8, -81), Vec3(3.7, 10.9, -36.4), 0.5, axis);
  hand.go({3.7, 10.9, -36.4}, {7.7, 13.9, -30.6}, 0.5, axis);
  hand.go({7.7, 13.9, -30.6}, in, 0.5, axis);
  Vec3 last = hand.last_force();
  int touched = 0;
  for (const Vec3& tip : test::straight(in, to, 0.1)) {
    const NeedleState& needle = hand.step(tip, axis);
    EXPECT_LT((needle.forces.force_n - last).norm(), 0.06) << tip.transpose();
    last = needle.forces.force_n;
    touched += needle.contact == ContactState::kTouching;
  }
  EXPECT_GT(touched, 10);
}

// Through the template and not in the tissue: the needle is a cantilever between hub and hole.
TEST(GuideForce, BeforeTheTissueIsTheBentNeedlesAlone) {
  GuidedHand hand(scene_of("template"));
  hand.go({0, 0, -70}, {0, 0, -30}, 0.5);
  const NeedleState& needle = hand.go({0, 0, -30}, {1.5, 0, -30}, 0.25);
  const double bending_nmm2 = Beam::bending_stiffness(200, 1.27, 1.0), arc = 200 - 30,
               k = 3 * bending_nmm2 / (arc * arc * arc);
  EXPECT_NEAR(needle.forces.force_n.x(), -1.5 * k, 0.01 * 1.5 * k);
  EXPECT_EQ(needle.forces.guide_n, needle.forces.force_n);
  EXPECT_EQ(needle.forces.axial_n, 0);
  EXPECT_EQ(needle.forces.lateral_n, 0);
  EXPECT_NEAR(needle.local_model.lateral_stiffness_n_per_mm, k, 0.01 * k);
}

}  // namespace
}  // namespace brachy
