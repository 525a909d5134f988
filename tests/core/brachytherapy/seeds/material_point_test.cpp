// From the position where a seed fell to its material point, for every model and every verdict of the field.
#include "core/brachytherapy/seeds/material_point.h"

#include <gtest/gtest.h>

#include <random>

#include "core/models/scalar_kernel/scalar_kernel_field.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy {
namespace {

Tissue small_tissue() {
  Scene scene;
  scene.tissue.points = 2000;
  return load_tissue(scene).tissue;
}

/// One landmark at the centre, displaced along x by `d`; ψ3,1, a = 12 mm: folds beyond 5.69 mm.
std::unique_ptr<ScalarKernelField> one_landmark(const Tissue& tissue, double d) {
  auto field =
      std::make_unique<ScalarKernelField>(tissue, Wendland31{}, 12, BlockField::Options{.max_landmarks = 4});
  const std::vector<Vec3> p = {Vec3::Zero()}, u = {Vec3(d, 0, 0)};
  EXPECT_TRUE(field->update(LandmarkSet::of(p, u)));
  return field;
}

TEST(MaterialPoint, IsWhereTheFieldTakesItFrom) {
  const Tissue tissue = small_tissue();
  const auto field = one_landmark(tissue, 5);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-14, 14);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 X(coordinate(random), coordinate(random), coordinate(random));
    const Vec3 x = X + field->displacement_at(X);
    const MaterialPoint found = find_material_point(*field, Verdict::kInjective, x, i % 2 ? X : x);
    ASSERT_EQ(found.result, Inversion::kFound) << X.transpose();
    EXPECT_LT((found.X - X).norm(), 1e-5) << X.transpose();
    EXPECT_LT((found.X + field->displacement_at(found.X) - x).norm(), kInversionTolerance);
    EXPECT_GT(found.F.determinant(), 0);
  }
}

// All at once, quickly: where the field contracts and where it does not (ψ3,1 at 5 mm has strains up to 1.2).
TEST(MaterialPoint, OfManyAreThoseOfEach) {
  const Tissue tissue = small_tissue();
  for (const double d : {2.0, 5.0}) {
    const auto field = one_landmark(tissue, d);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> coordinate(-14, 14);
    std::vector<Vec3> at_rest, now;
    for (int i = 0; i < 500; ++i) {
      at_rest.emplace_back(coordinate(random), coordinate(random), coordinate(random));
      now.push_back(at_rest.back() + field->displacement_at(at_rest.back()));
    }
    std::vector<Vec3> found(now.size());
    find_material_points(*field, Verdict::kInjective, now, found);
    for (std::size_t i = 0; i < found.size(); ++i)
      ASSERT_LT((found[i] - at_rest[i]).norm(), 0.01) << d << ": " << at_rest[i].transpose();
  }
}

TEST(MaterialPoint, OutOfReachIsItself) {
  const Tissue tissue = small_tissue();
  const auto field = one_landmark(tissue, 5);
  const MaterialPoint found = find_material_point(*field, Verdict::kInjective, {0, 0, 20}, {0, 0, 19});
  EXPECT_EQ(found.result, Inversion::kFound);
  EXPECT_TRUE(found.X.isApprox(Vec3(0, 0, 20), 1e-12));
  EXPECT_TRUE(found.F.isApprox(Mat3::Identity(), 1e-9));
}

// det J = 1 + (9/12) ψ′(r) cos θ: at the landmark it is 1, at r = 1/4 before it negative.
TEST(MaterialPoint, OfAFoldedFieldIsRefusedWhereItFoldsAndAmbiguousElsewhere) {
  const Tissue tissue = small_tissue();
  const auto field = one_landmark(tissue, 9);
  const MaterialPoint beside = find_material_point(*field, Verdict::kFolded, {9, 0, 0}, {0, 0, 0});
  EXPECT_EQ(beside.result, Inversion::kAmbiguous);
  EXPECT_LT(beside.X.norm(), 1e-6);  // the point that the needle has cut to
  const Vec3 turned(3, 0, 0);
  const Vec3 x = turned + field->displacement_at(turned);
  EXPECT_EQ(find_material_point(*field, Verdict::kFolded, x, turned).result, Inversion::kFolded);
}

// With an unknown verdict: several material points must be detected; elsewhere the point is found.
TEST(MaterialPoint, WhereSeveralPlacesComeToOneItIsAmbiguousUnlessCertified) {
  const Tissue tissue = small_tissue();
  const auto field = one_landmark(tissue, 9);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> coordinate(-13, 13);
  int refused = 0, found_right = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 X(coordinate(random), coordinate(random), coordinate(random));
    const Vec3 x = X + field->displacement_at(X);
    const MaterialPoint found = find_material_point(*field, Verdict::kUnknown, x, X);
    if (found.result != Inversion::kFound) {
      ++refused;
      continue;
    }
    EXPECT_LT((found.X - X).norm(), 1e-5) << "the place of another point, " << X.transpose();
    ++found_right;
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(found_right, 700);
}

}  // namespace
}  // namespace brachy
