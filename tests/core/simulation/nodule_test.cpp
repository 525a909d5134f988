// Needles into nodules of any size and stiffness: no tick without a solution is silent, nothing traps a needle, and
// what the hand puts in is never less than what it gets back.
#include <gtest/gtest.h>

#include <iostream>

#include "tests/core/simulation/phantom_scene.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/sanitized.h"
#include "tests/scene_count.h"

namespace brachy {
namespace {

using test::needle_pose;
using test::pose_at;

constexpr int kInsertionsOfModel = 50;

double uniform_log(std::mt19937_64& random, double least, double most) {
  return least * std::pow(most / least, test::uniform(random, 0, 1));
}

struct Nodule {
  Vec3 centre;
  double radius, contrast;
};

Nodule random_nodule(std::mt19937_64& random) {
  return {test::uniform_point(random, 12), test::uniform(random, 3, 20), uniform_log(random, 0.3, 30)};
}

Scene scene_of(const Nodule& nodule, bool has_capsule) {
  Scene scene;
  scene.tissue.points = 1500;
  RegionSettings region;
  region.shape = "sphere";
  region.centre_mm = nodule.centre;
  region.semi_axes_mm = Vec3::Constant(nodule.radius);
  region.shear_modulus_kpa = scene.tissue.shear_modulus_kpa * nodule.contrast;
  if (has_capsule) region.contact = scene.tissue.contact;
  scene.regions.push_back(region);
  return scene;
}

/// A way in, past the nodule's middle by up to 1.2 of its radius, to any depth in it or behind it, and out again.
struct Way {
  Vec3 axis, out, in;
  double stride_mm;
};

Way random_way(std::mt19937_64& random, const Nodule& nodule) {
  Way way;
  way.axis = test::uniform_point(random, 1).normalized();
  const Vec3 any = test::uniform_point(random, 1);
  const Vec3 across = (any - any.dot(way.axis) * way.axis).normalized();
  const Vec3 beside = nodule.centre + test::uniform(random, 0, 1.2) * nodule.radius * across;
  way.in = beside + test::uniform(random, -1, 1.5) * nodule.radius * way.axis;
  way.out = beside - 60 * way.axis;
  way.stride_mm = uniform_log(random, 0.1, 1);
  return way;
}

struct NoduleFelt {
  int ticks = 0, unsolved = 0, silent = 0;
  double work_nmm = 0, through_nmm = 0;
  bool is_finite = true, is_free = true, at_rest = false;
};

bool has(const MeshState& state, std::uint32_t flag) {
  return (state.summary.step_flags & flag) != 0;
}

NoduleFelt feel(const std::shared_ptr<const SimulationModel>& model, const Way& way) {
  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  const std::vector<float> rest = state.mesh.deformed_vertices;
  NoduleFelt felt;
  Vec3 last_force = Vec3::Zero(), last_tip = way.out;
  std::vector<Vec3> tips = test::straight(way.out, way.in, way.stride_mm);
  tips.insert(tips.end(), tips.rbegin(), tips.rend());
  for (const Vec3& tip : tips) {
    simulator.step(needle_pose(pose_at(tip, way.axis)), state);
    const NeedleForces& forces = state.needles.states[0].forces;
    const bool failed = has(state, kStepSolveFailed);
    ++felt.ticks;
    felt.unsolved += failed ? 1 : 0;
    const bool knows = state.summary.certificate.verdict == Verdict::kInjective && !failed;
    felt.silent += !knows && !has(state, kStepSolveFailed | kStepUncertified | kStepFolded) ? 1 : 0;
    felt.is_finite &= forces.is_finite();
    const double done = -0.5 * (forces.force_n + last_force).dot(tip - last_tip);
    felt.work_nmm += done;
    felt.through_nmm += std::abs(done);
    last_force = forces.force_n;
    last_tip = tip;
  }
  const NeedleState& needle = state.needles.states[0];
  felt.is_free = needle.contact != ContactState::kInserted && needle.forces.force_n.norm() < 1e-9;
  felt.at_rest = state.mesh.deformed_vertices == rest;
  return felt;
}

TEST(Nodule, NeverTrapsANeedleNorFailsWithoutAWord) {
  std::mt19937_64 random(11);
  // BRACHY_SCENES counts insertions; in tests a few into each of a few nodules.
  const bool is_whole = test::is_campaign();
  const int models = is_whole             ? std::max(1, test::scene_count(0) / kInsertionsOfModel)
                     : test::kIsSanitized ? 1
                                          : 3;
  const int insertions = is_whole ? kInsertionsOfModel : test::kIsSanitized ? 1 : 2;
  int ticks = 0, unsolved = 0;
  for (int m = 0; m < models; ++m) {
    const Nodule nodule = random_nodule(random);
    const Scene scene = scene_of(nodule, m % 2 == 1);
    const auto model = load_simulation_model(scene, load_tissue(scene).tissue);
    for (int i = 0; i < insertions; ++i) {
      SCOPED_TRACE(testing::Message() << "model " << m << ", way " << i << ": radius " << nodule.radius
                                      << " mm, contrast " << nodule.contrast);
      const NoduleFelt felt = feel(model, random_way(random, nodule));
      ticks += felt.ticks;
      unsolved += felt.unsolved;
      EXPECT_EQ(felt.silent, 0);
      EXPECT_TRUE(felt.is_finite);
      EXPECT_TRUE(felt.is_free);
      EXPECT_TRUE(felt.at_rest);
      EXPECT_GE(felt.work_nmm, -1e-12 * felt.through_nmm);  // rounding, where it only presses
    }
  }
  std::cout << unsolved << " of " << ticks << " ticks without a solution\n";
  EXPECT_LE(unsolved, 1e-3 * ticks);
}

}  // namespace
}  // namespace brachy
