#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <numeric>

#include "core/models/guard/guarded_field.h"
#include "core/models/matrix_kernel/matrix_composition.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/scalar_kernel/scalar_composition.h"
#include "core/models/scalar_kernel/scalar_kernel_field.h"
#include "core/simulation/mesh_state.h"
#include "tests/core/injectivity/random_scene.h"
#include "tests/core/models/blocks/small_tissue.h"
#include "tests/core/models/deformation_gradient.h"
#include "tests/sanitized.h"
#include "tests/scene_count.h"

// Invariants of every scene, on thousands of random ones: scripts/campaigns/campaign.sh runs 100,000.

namespace brachy {
namespace {

constexpr std::size_t kMostLandmarks = 40;
constexpr double kSupport = 12;

const Tissue& tissue() {
  static const Tissue small = test::small_phantom(Vec3::Zero());
  return small;
}

std::unique_ptr<GuardedField> guarded(const std::string& model_name, const std::string& policy) {
  const SimdTarget target = best_simd_target();
  std::unique_ptr<TissueField> field;
  std::unique_ptr<Composition> composition;
  if (const auto kernel = find_kernel(model_name)) {
    field = std::make_unique<ScalarKernelField>(
        tissue(), *kernel, kSupport, BlockField::Options{.target = target, .max_landmarks = kMostLandmarks});
    composition = std::make_unique<ScalarComposition>(tissue(), *kernel, kSupport, target, kMostLandmarks, 8);
  } else {
    const bool composes = model_name == "elastic" && policy == "substep";
    auto matrix = std::make_unique<MatrixKernelField>(
        tissue(), model_name, ElasticBody{},
        MatrixKernelField::Options{
            .target = target, .max_landmarks = kMostLandmarks, .evaluates_points = !composes});
    if (composes)
      composition = std::make_unique<MatrixComposition>(tissue(), *matrix, target, kMostLandmarks, 8);
    field = std::move(matrix);
  }
  return std::make_unique<GuardedField>(tissue(), std::move(field), std::move(composition),
                                        GuardSettings{.policy = policy});
}

// Scenes about the origin lie in the phantom.
test::RandomScene scene_in_phantom(test::RandomScenes& scenes) {
  test::RandomScene scene = scenes.next(kSupport, kSupport, 20);
  Vec3 centre = Vec3::Zero();
  for (const Vec3& p : scene.positions) centre += p / static_cast<double>(scene.positions.size());
  double reach = 1;
  for (const Vec3& p : scene.positions) reach = std::max(reach, (p - centre).norm());
  for (Vec3& p : scene.positions)
    p = (p - centre) * std::min(1.0, 18 / reach);  // the phantom's least semi-axis is 20 mm
  return scene;
}

double distance_to_shaft(const std::vector<Vec3>& landmarks, const Vec3& X) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const Vec3 from = landmarks[i], way = landmarks[std::min(i + 1, landmarks.size() - 1)] - from;
    const double t = std::clamp((X - from).dot(way) / std::max(way.squaredNorm(), 1e-12), 0.0, 1.0);
    least = std::min(least, (X - from - t * way).norm());
  }
  return least;
}

bool is_finite(const GuardedField& field) {
  for (const std::uint32_t b : field.touched()) {
    const BlockDisplacement<float>& u = field.displacement(b);
    float sum = 0;
    for (std::size_t i = 0; i < Tissue::kBlockSize; ++i) sum += u.ux[i] + u.uy[i] + u.uz[i];
    if (!std::isfinite(sum)) return false;
  }
  return true;
}

class EveryModel : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Property, EveryModel,
                         testing::Values("psi31", "psi30", "psi32", "buhmann", "compact_elastic", "elastic"),
                         [](const auto& model_name) { return model_name.param; });

TEST_P(EveryModel, IsFiniteReproducesItsLandmarksAndIsWithinItsCertificateOrFlagged) {
  const bool is_scalar = find_kernel(GetParam()).has_value();
  const auto field = guarded(GetParam(), "substep");
  test::RandomScenes scenes(5);
  int solved = 0, unknown = 0, held = 0, substepped = 0;
  const int count = test::scene_count(test::kIsSanitized ? 60 : is_scalar ? 600 : 180) / 6;
  for (int i = 0; i < count; ++i) {
    SCOPED_TRACE(i);
    const test::RandomScene scene = scene_in_phantom(scenes);
    if (!field->update(LandmarkSet::of(scene.positions, scene.displacements)))
      continue;  // refused with a reason
    ++solved;
    const Certificate& c = field->certificate();
    const std::uint32_t flags = field->flags();
    ASSERT_TRUE(is_finite(*field));
    EXPECT_EQ(c.verdict == Verdict::kFolded, (flags & kStepFolded) != 0);
    EXPECT_EQ(c.verdict == Verdict::kUnknown, (flags & kStepUncertified) != 0);
    EXPECT_EQ(c.held_mm > 0, (flags & kStepClamped) != 0);
    if (c.verdict == Verdict::kInjective) {
      EXPECT_GT(c.det_bound, 0);
      EXPECT_GE(c.vertex_det, c.det_bound - 1e-4);
    }
    // Landmarks reach their prescribed positions, or all the same share of the way.
    double largest = 0;
    for (const Vec3& d : scene.displacements) largest = std::max(largest, d.norm());
    const double share = 1 - c.held_mm / largest;
    // the elastic models' tables, and their rings
    const bool is_composed = GetParam() == "elastic";
    const double tolerance = is_scalar ? 1e-6 : is_composed ? 0.02 : 0.03 * largest + 1e-3;
    for (std::size_t k = 0; k < scene.positions.size() && !(is_composed && c.held_mm > 0); ++k)
      EXPECT_LT((field->displacement_at(scene.positions[k]) - share * scene.displacements[k]).norm(),
                tolerance * std::max(1.0, field->plain_field().condition() * 1e-6));
    unknown += c.verdict == Verdict::kUnknown;
    held += c.held_mm > 0;
    substepped += c.substeps > 1;
  }
  EXPECT_GT(solved, count / 2);
  if (count > 100)
    std::cout << GetParam() << ": " << solved << " of " << count << " solved, " << unknown << " unknown, "
              << substepped << " sub-stepped, " << held << " clamped\n";
  ASSERT_TRUE(field->update(LandmarkSet::of({})));
  EXPECT_TRUE(field->touched().empty());
  EXPECT_EQ(field->certificate().verdict, Verdict::kInjective);
}

// Wherever a certified field is asked, most often near its landmarks, its determinant is above the bound. `elastic` has
// none within three radii of a shaft's axis.
TEST_P(EveryModel, IsNeverWronglyInjective) {
  const auto field = guarded(GetParam(), "substep");
  const double clearance = GetParam() == "elastic" ? 3 * ElasticBody{}.needle_radius : 0;
  test::RandomScenes scenes(7), places(8);
  constexpr int kPlaces = 200;
  int injective = 0, substepped = 0, wrong = 0;
  const int count = test::scene_count(test::kIsSanitized ? 30 : 180) / 6;
  for (int i = 0; i < count; ++i) {
    SCOPED_TRACE(i);
    const test::RandomScene scene = scene_in_phantom(scenes);
    if (!field->update(LandmarkSet::of(scene.positions, scene.displacements))) continue;
    const Certificate& c = field->certificate();
    if (c.verdict != Verdict::kInjective) continue;
    ++injective;
    substepped += c.substeps > 1;
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < kPlaces; ++k) {
      const auto n = static_cast<std::size_t>(places.uniform() * double(scene.positions.size()));
      const Vec3 X = scene.positions[n] + places.between(0, 8) * places.direction();
      if (distance_to_shaft(scene.positions, X) >= clearance)
        least = std::min(least, test::deformation_gradient(*field, X).determinant());
    }
    EXPECT_GT(least, c.det_bound - 1e-6);
    wrong += least <= 0;
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(injective, count / 2);
  if (count > 100)
    std::cout << GetParam() << ": " << injective << " of " << count << " injective, " << substepped
              << " sub-stepped, " << wrong << " wrong\n";
}

// The tissue is fixed here, so single points are compared.
TEST_P(EveryModel, OrderOfLandmarksDoesNotMatter) {
  if (GetParam() == "elastic") GTEST_SKIP() << "its shafts are landmarks in order";
  const auto field = guarded(GetParam(), "flag"), shuffled = guarded(GetParam(), "flag");
  test::RandomScenes scenes(6);
  for (int i = 0; i < test::scene_count(140) / 7; ++i) {
    const test::RandomScene scene = scene_in_phantom(scenes);
    std::vector<Vec3> p(scene.positions.rbegin(), scene.positions.rend()),
        d(scene.displacements.rbegin(), scene.displacements.rend());
    if (!field->update(LandmarkSet::of(scene.positions, scene.displacements))) continue;
    ASSERT_TRUE(shuffled->update(LandmarkSet::of(p, d)));
    double largest = 0;
    for (const Vec3& way : d) largest = std::max(largest, way.norm());
    for (int k = 0; k < 8; ++k) {
      const Vec3 X = scenes.between(0, 25) * scenes.direction();
      EXPECT_LT((field->displacement_at(X) - shuffled->displacement_at(X)).norm(),
                1e-9 * largest * std::max(1.0, field->plain_field().condition() * 1e-5));
    }
  }
}

class EveryKernel : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Property, EveryKernel, testing::Values("psi31", "psi30", "psi32", "buhmann"),
                         [](const auto& model_name) { return model_name.param; });

TEST_P(EveryKernel, TurnsAndMovesWithTheScene) {
  const auto field = guarded(GetParam(), "flag"), moved = guarded(GetParam(), "flag");
  test::RandomScenes scenes(7);
  for (int i = 0; i < test::scene_count(80) / 4; ++i) {
    const test::RandomScene scene = scene_in_phantom(scenes);
    const Mat3 R = Eigen::AngleAxisd(scenes.between(0, 3), scenes.direction()).toRotationMatrix();
    const Vec3 t = scenes.between(0, 100) * scenes.direction();
    std::vector<Vec3> p, d;
    for (const Vec3& x : scene.positions) p.push_back(R * x + t);
    for (const Vec3& x : scene.displacements) d.push_back(R * x);
    if (!field->update(LandmarkSet::of(scene.positions, scene.displacements))) continue;
    ASSERT_TRUE(moved->update(LandmarkSet::of(p, d)));
    for (int k = 0; k < 8; ++k) {
      const Vec3 X = scenes.between(0, 25) * scenes.direction();
      EXPECT_LT((R * field->displacement_at(X) - moved->displacement_at(R * X + t)).norm(),
                1e-8 * std::max(1.0, field->plain_field().condition() * 1e-5));
    }
    // Cells lie along the axes: the verdict may become unknown, but not the opposite.
    const Verdict a = field->certificate().verdict, b = moved->certificate().verdict;
    EXPECT_TRUE(a == b || a == Verdict::kUnknown || b == Verdict::kUnknown);
  }
}

}  // namespace
}  // namespace brachy
