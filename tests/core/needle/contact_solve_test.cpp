// A tick whose landmarks have no solution: the needle goes on, its force fades, and nothing holds it outside.
#include "core/needle/contact_solve.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "core/models/step_flag.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy {
namespace {

/// Every landmark on a spring of its own; its system is not definite while it is told so.
class SpringField : public TissueField {
 public:
  static constexpr double kSpring = 0.75;  // N/mm
  SpringField() : TissueField({.max_landmarks = 41}) {}
  bool is_solvable = true;

  std::span<const std::uint32_t> touched() const override { return {}; }
  const BlockDisplacement<float>& displacement(std::uint32_t) const override { return nowhere_; }
  Vec3 displacement_at(const Vec3&) const noexcept override { return Vec3::Zero(); }
  const CellField& cells() noexcept override { std::abort(); }  // nobody certifies it
  std::size_t max_sources() const override { return 0; }

 private:
  FactorStatus do_factorize(const LandmarkSet& landmarks, double&) noexcept override {
    if (!is_solvable && !landmarks.positions.empty()) return {FactorStatus::kNotPositiveDefinite};
    return {};
  }
  void do_solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept override {
    for (std::size_t i = 0; i < displacements.size(); ++i) weights[i] = kSpring * displacements[i];
  }
  void do_project_inverse(std::size_t, std::span<const Vec3>,
                          Eigen::Ref<Eigen::MatrixXd> H) noexcept override {
    H.setIdentity();
    H *= kSpring;
  }
  Evaluation do_evaluate(bool, std::span<Vec3> weights) noexcept override {
    do_solve(displacements(), weights);
    return Evaluation::kDirect;
  }
  void do_rescale(double) noexcept override {}

  BlockDisplacement<float> nowhere_{};
};

struct Unsolved : ::testing::Test {
  FactorStatus step(const Vec3& tip) {
    needles[0].begin(test::pose_at(tip, Vec3::UnitZ()), &field);
    landmarks.clear();
    std::uint32_t index = 0;
    for (const NeedleLandmark& l : needles[0].landmarks()) {
      landmarks.add(l.position, l.if_stuck, l.spread);
      landmarks.owners.push_back({0, index++});
    }
    const FactorStatus status = solve.solve(++tick, needles, nullptr, landmarks, field, flags);
    if (status) {
      EXPECT_TRUE(field.update(landmarks));
    }
    return status;
  }
  void go(const Vec3& from, const Vec3& to) {
    for (const Vec3& tip : test::straight(from, to, 0.25)) step(tip);
  }
  const NeedleContact& needle() const { return needles[0]; }

  Scene scene;
  Tissue tissue = [] {
    Scene small;
    small.tissue.points = 1300;
    return load_tissue(small).tissue;
  }();
  SurfaceBvh surface{{{tissue.rest_vertices.begin(),
                       tissue.rest_vertices.begin() + static_cast<std::ptrdiff_t>(tissue.surface_count)},
                      tissue.triangles}};
  NeedleTissues tissues{scene.tissue.contact, {}, scene.needle.diameter_mm};
  SpringField field;
  ContactSolve solve{41};
  LandmarkSet landmarks = [] {
    LandmarkSet set;
    set.reserve(41);
    return set;
  }();
  std::vector<NeedleContact> needles = [&] {
    std::vector<NeedleContact> one;
    one.emplace_back(surface, tissues, scene.needle, scene.contact);
    return one;
  }();
  std::uint64_t tick = 0;
  std::uint32_t flags = 0;
  const Vec3 below{8, -4, -36}, deep{8, -4, 12};
};

TEST_F(Unsolved, NothingHoldsTheNeedleOnItsWayOut) {
  go(below, deep);
  ASSERT_EQ(needle().state(), ContactState::kInserted);
  ASSERT_GT(needle().forces().axial_n, 3);
  field.is_solvable = false;
  go(deep, below);
  EXPECT_EQ(needle().state(), ContactState::kWithdrawn);
  EXPECT_TRUE(needle().landmarks().empty());
  EXPECT_EQ(needle().forces(), NeedleForces{});
  field.is_solvable = true;
  EXPECT_TRUE(step(below));
}

TEST_F(Unsolved, ItsForceFadesAndTheLocalModelHasItAlone) {
  go(below, deep);
  const NeedleForces before = needle().forces();
  field.is_solvable = false;
  EXPECT_FALSE(step(deep));
  const double kept = std::exp(-0.005 / NeedleContact::kUnsolvedFade);
  EXPECT_LT((needle().forces().force_n - kept * before.force_n).norm(), 1e-12);
  const LocalContactModel& model = needle().local_model();
  EXPECT_TRUE(model.in_contact);
  EXPECT_FALSE(model.is_capsule);
  EXPECT_EQ(model.lateral_n, needle().forces().force_n);
  EXPECT_EQ(model.lateral_stiffness_n_per_mm, 0);
  EXPECT_EQ(model.axial_stiffness_n_per_mm, 0);
  for (int i = 0; i < 200; ++i) step(deep);
  EXPECT_LT(needle().forces().force_n.norm(), 1e-6);
}

TEST_F(Unsolved, TheTipGoesOnAndTheNextSolutionIsFromThere) {
  go(below, deep);
  const double depth = needle().insertion_depth();
  field.is_solvable = false;
  go(deep, deep + 5 * Vec3::UnitZ());
  EXPECT_NEAR(needle().insertion_depth(), depth + 5, 1e-9);
  field.is_solvable = true;
  EXPECT_TRUE(step(deep + 5 * Vec3::UnitZ()));
  EXPECT_EQ(needle().state(), ContactState::kInserted);
  EXPECT_TRUE(needle().forces().is_finite());
}

TEST_F(Unsolved, ItsLandmarksAreNotSettled) {
  go(below, deep);
  EXPECT_NE(landmarks.revision().displacements, 0u);
  field.is_solvable = false;
  EXPECT_FALSE(step(deep));
  EXPECT_NE(landmarks.revision().positions, 0u);
  EXPECT_EQ(landmarks.revision().displacements, 0u);
}

TEST_F(Unsolved, ACapsuleIsNotPunctured) {
  field.is_solvable = false;
  go(below, {8, -4, 0});
  EXPECT_EQ(needle().state(), ContactState::kTouching);
  EXPECT_EQ(needle().puncture_count(), 0u);
}

}  // namespace
}  // namespace brachy
