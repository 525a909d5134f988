#include "core/models/matrix_kernel/matrix_kernel_field.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>

#include "core/base/error.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/models/matrix_kernel/smooth_tables.h"
#include "core/scene/load_tissue.h"
#include "tests/core/models/blocks/reactions.h"
#include "tests/sanitized.h"

namespace brachy {
namespace {

const Tissue& phantom() {
  static const Tissue tissue = load_tissue(Scene{}).tissue;
  return tissue;
}

ElasticBody body_of(double stiffness) {
  ElasticBody body;
  if (stiffness != 1)
    body.regions.push_back(
        std::make_shared<EllipsoidRegion>(Vec3(0, 0, 0), Vec3(30, 25, 27), stiffness * body.shear_modulus));
  return body;
}

// All fields of a model and a body share kernel and tables, which fem makes in seconds.
MatrixKernelField shared_field(const char* model_name, double stiffness,
                               const MatrixKernelField::Options& options = {}) {
  struct Made {
    std::shared_ptr<const MatrixKernel> kernel;
    std::shared_ptr<const SmoothTables> tables;
  };
  static std::map<std::pair<std::string, double>, Made> all;
  Made& made = all[{model_name, stiffness}];
  if (!made.kernel) {
    made.kernel = make_matrix_kernel(model_name, body_of(stiffness));
    made.tables = make_smooth_tables(phantom(), *made.kernel, options.target);
  }
  return {phantom(), made.kernel, made.tables, body_of(stiffness), options};
}

struct Needle {
  std::vector<Vec3> positions, displacements;
};

// A shaft through the gland, dragged along and aside, its tip last.
Needle shaft() {
  Needle needle;
  for (int k = 0; k <= 6; ++k) {
    needle.positions.push_back(Vec3(3, -2, -19) + 5.0 * k * Vec3(0.1, 0, 0.99));
    needle.displacements.push_back(Vec3(0.3, 0.1 * k, 1.5));
  }
  return needle;
}

// Largest difference at the tissue's points from the exact system, over the largest displacement.
double difference(const MatrixKernelField& fast, const Needle& needle) {
  MatrixKernelSystem system(fast.kernel());
  EXPECT_TRUE(system.factorize(needle.positions));
  const std::vector<Vec3> forces = system.solve(needle.displacements);
  double worst = 0, largest = 0;
  std::vector<Vec3> X, u;
  for (const std::uint32_t b : fast.touched()) {
    const Block& block = phantom().blocks[b];
    const BlockDisplacement<float>& d = fast.displacement(b);
    for (std::uint32_t i = 0; i < block.count; i += 7) {
      X.push_back(phantom().rest_vertices[block.first + i]);
      u.emplace_back(d.ux[i], d.uy[i], d.uz[i]);
    }
  }
  const std::vector<Vec3> exact = system.evaluate(X, forces);
  for (std::size_t i = 0; i < X.size(); ++i) {
    worst = std::max(worst, (u[i] - exact[i]).norm());
    largest = std::max(largest, exact[i].norm());
  }
  return worst / largest;
}

class EveryModel : public testing::TestWithParam<const char*> {};

TEST_P(EveryModel, TicksAreTheExactSystemsFieldWithinOnePercent) {
  for (const double stiffness : {1.0, 3.0}) {
    MatrixKernelField fast = shared_field(GetParam(), stiffness);
    const Needle needle = shaft();
    ASSERT_TRUE(fast.update(LandmarkSet::of(needle.positions, needle.displacements)));
    EXPECT_EQ(fast.evaluation(), Evaluation::kDirect);
    EXPECT_LT(difference(fast, needle), 0.01) << stiffness;
  }
}

TEST_P(EveryModel, ShaftsThatComeFromOutsideAreAsExact) {
  Needle needle = shaft();
  for (int k = 1; k <= 5; ++k) {
    needle.positions.insert(needle.positions.begin(), needle.positions.front() - 4.0 * Vec3(0.1, 0, 0.99));
    needle.displacements.insert(needle.displacements.begin(), Vec3(0.3, 0, 1.5));
  }
  for (const double stiffness : {1.0, 3.0}) {
    MatrixKernelField fast = shared_field(GetParam(), stiffness);
    ASSERT_TRUE(fast.update(LandmarkSet::of(needle.positions, needle.displacements)));
    EXPECT_LT(difference(fast, needle), 0.01) << stiffness;
  }
}

TEST_P(EveryModel, LandmarksGoWhereTheyAreTold) {
  MatrixKernelField fast = shared_field(GetParam(), 1);
  const Needle contact{{Vec3(0, 0, -22)}, {Vec3(0, 0, 2)}};
  ASSERT_TRUE(fast.update(LandmarkSet::of(contact.positions, contact.displacements)));
  // The displacement prescribed is the landmark's own observation, an average over its core.
  MatrixKernelSystem system(fast.kernel());
  ASSERT_TRUE(system.factorize(contact.positions));
  EXPECT_LT((system.solve(contact.displacements)[0] - fast.forces()[0]).norm(),
            2e-3 * fast.forces()[0].norm());
}

TEST_P(EveryModel, TheSameTicksInAnyHistoryGiveTheSameBits) {
  const Needle needle = shaft();
  MatrixKernelField a = shared_field(GetParam(), 1);
  // With a kernel and tables of its own.
  MatrixKernelField b(phantom(), GetParam(), body_of(1), {.threads = 2});
  for (std::size_t n = 2; n <= needle.positions.size(); ++n)
    ASSERT_TRUE(a.update(
        LandmarkSet::of(std::span(needle.positions).first(n), std::span(needle.displacements).first(n))));
  ASSERT_TRUE(b.update(LandmarkSet::of(needle.positions, needle.displacements)));
  for (const std::uint32_t block : a.touched())
    for (std::size_t i = 0; i < Tissue::kBlockSize; ++i)
      ASSERT_EQ(a.displacement(block).uz[i], b.displacement(block).uz[i]);
}

TEST_P(EveryModel, LandmarksThatLeftAreReadAnewWhenTheyComeBack) {
  Needle before = shaft(), after = shaft();
  after.positions.front() += Vec3(0.2, 0, 0);
  MatrixKernelField a = shared_field(GetParam(), 1), b = shared_field(GetParam(), 1);
  ASSERT_TRUE(a.update(LandmarkSet::of(before.positions, before.displacements)));
  // The first one moves while the last three are removed; these are then restored.
  ASSERT_TRUE(a.update(
      LandmarkSet::of(std::span(after.positions).first(4), std::span(after.displacements).first(4))));
  ASSERT_TRUE(a.update(LandmarkSet::of(after.positions, after.displacements)));
  ASSERT_TRUE(b.update(LandmarkSet::of(after.positions, after.displacements)));
  for (std::size_t l = 0; l < a.forces().size(); ++l) EXPECT_EQ(a.forces()[l], b.forces()[l]) << l;
}

// A landmark's rings follow from its whole shaft: where the line turns too far it breaks, two landmarks further on.
TEST_P(EveryModel, AShaftThatBreaksIsReadAnew) {
  Needle needle = shaft();
  MatrixKernelField a = shared_field(GetParam(), 1), b = shared_field(GetParam(), 1);
  ASSERT_TRUE(a.update(LandmarkSet::of(needle.positions, needle.displacements)));
  needle.positions[1] += Vec3(4, 0, 0);  // the line turns by more than 30° at landmarks 1 and 2
  ASSERT_TRUE(a.update(LandmarkSet::of(needle.positions, needle.displacements)));
  ASSERT_TRUE(b.update(LandmarkSet::of(needle.positions, needle.displacements)));
  for (std::size_t l = 0; l < needle.positions.size(); ++l) EXPECT_EQ(a.forces()[l], b.forces()[l]) << l;
}

TEST_P(EveryModel, ReactionsAreForcesOfThePlacedLandmarks) {
  const bool is_compact = is_compact_model(GetParam());
  MatrixKernelField field = shared_field(GetParam(), 1, {.landmark_stiffness_n_per_mm = 0.2});
  const std::vector<Vec3> lone = {{1, 2, 3}}, d = {{1, -2, 0.5}};
  std::vector<Vec3> f(1);
  ASSERT_TRUE(field.factorize(LandmarkSet::of(lone)));
  field.solve(d, f);
  MatrixKernelSystem system(field.kernel());
  ASSERT_TRUE(system.factorize(lone));
  const Vec3 expected = is_compact ? 0.2 * d[0] : system.solve(d)[0];
  EXPECT_LT((f[0] - expected).norm(), (is_compact ? 1e-12 : 2e-3) * expected.norm());

  test::expect_axial_stiffness(field, shaft().positions, {}, 0);
  test::expect_axial_stiffness(field, shaft().positions, {}, 3);
  std::mt19937_64 random(31);
  const auto now = test::random_landmarks(random, 9, 12, 5, 2),
             next = test::random_landmarks(random, 30, 15, 4, 2);
  test::expect_axial_stiffness(field, next.positions, {}, 12);
  MatrixKernelField fresh = shared_field(GetParam(), 1, {.landmark_stiffness_n_per_mm = 0.2});
  test::expect_factorize_leaves_the_field(field, fresh, now, next);
}

TEST_P(EveryModel, CoresAreAnotherSetWhereTheyAreLookedAt) {
  const bool is_compact = is_compact_model(GetParam());
  MatrixKernelField field = shared_field(GetParam(), 1);
  const std::vector<Vec3> positions = {{0, 0, 0}, {0, 0, 9}}, d = {{0, 0, 1}, {1, 0, 1}};
  const std::vector<LandmarkSpread> cores = {{}, {.core_mm = 6}}, none(2);
  LandmarkSet landmarks = LandmarkSet::of(positions, d);
  ASSERT_TRUE(field.update(landmarks));
  const double force = field.total_force_n();
  landmarks.assign(positions, d, none);
  ASSERT_TRUE(field.update(landmarks));
  EXPECT_EQ(field.evaluation(), Evaluation::kIdle);
  landmarks.assign(positions, d, cores);
  ASSERT_TRUE(field.update(landmarks));
  EXPECT_EQ(field.evaluation(), is_compact ? Evaluation::kIdle : Evaluation::kDirect);
  if (is_compact)
    EXPECT_EQ(field.total_force_n(), force);
  else
    EXPECT_GT(field.total_force_n(), 1.5 * force);
  test::expect_axial_stiffness(field, positions, cores, 0);
}

std::vector<const char*> models_to_run() {
  std::vector<const char*> models = {"compact_elastic", "elastic"};
  if (!test::kIsSanitized) models.push_back("fem");
  return models;
}

INSTANTIATE_TEST_SUITE_P(Models, EveryModel, testing::ValuesIn(models_to_run()),
                         [](const auto& model_name) { return model_name.param; });

// Where a region fills part of the tissue, a contact in it has a smoothed stiffness: stiffer than without the region,
// softer than exact.
TEST(MatrixKernelField, AContactInANoduleIsSolvedByTheSmoothedTable) {
  ElasticBody body;
  body.regions.push_back(
      std::make_shared<EllipsoidRegion>(Vec3(2, 0, 0), Vec3(17, 14, 15), 2 * body.shear_modulus));
  MatrixKernelField fast(phantom(), "elastic", body, {});
  const Needle contact{{Vec3(2, 0, 0)}, {Vec3(0, 0, 1)}};
  ASSERT_TRUE(fast.update(LandmarkSet::of(contact.positions, contact.displacements)));
  MatrixKernelSystem exact(fast.kernel());
  ASSERT_TRUE(exact.factorize(contact.positions));
  const double force = exact.solve(contact.displacements)[0].z();
  EXPECT_GT(fast.forces()[0].z(), 0.5 * force);
  EXPECT_LT(fast.forces()[0].z(), force);
}

TEST(MatrixKernelField, NoLandmarksNoField) {
  MatrixKernelField fast(phantom(), "compact_elastic", body_of(1), {});
  ASSERT_TRUE(fast.update(LandmarkSet::of({})));
  EXPECT_TRUE(fast.touched().empty());
  EXPECT_EQ(fast.displacement_at({1, 2, 3}), Vec3(0, 0, 0));
}

TEST(MatrixKernelField, RefusesWhatCannotBeSolvedByName) {
  MatrixKernelField fast(phantom(), "compact_elastic", body_of(1), {});
  const std::vector<Vec3> twice = {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}, d(3, Vec3(0, 0, 1));
  const FactorStatus status = fast.update(LandmarkSet::of(twice, d));
  EXPECT_EQ(status.kind, FactorStatus::kDuplicate);
  EXPECT_EQ(status.first, 0);
  EXPECT_EQ(status.second, 2);
}

TEST(MatrixKernelField, RefusesTissueOutsideTheBox) {
  ElasticBody body;
  body.box_size = Vec3::Constant(30);
  EXPECT_THROW(MatrixKernelField(phantom(), "compact_elastic", body, {}), UserError);
}

// Two needles that bend, 22 landmarks each: so many that their compliance is a term of few columns. The forces are
// those that a rigid needle has where these needles are: K f = d − C f.
TEST(MatrixKernelField, SolvesBendingNeedlesAsRigidOnesWhereTheyHaveBent) {
  const MatrixKernelField::Options options{
      .max_landmarks = 60, .evaluates_points = false, .keeps_matrix = true};
  MatrixKernelField bending(phantom(), "elastic", body_of(1), options),
      rigid(phantom(), "elastic", body_of(1), options);
  LandmarkSet bends, stays;
  std::vector<Vec3> positions, displacements;
  for (const double x : {-6.0, 6.0})
    for (int k = 0; k < 22; ++k) {
      positions.emplace_back(x, 1, -20 + 1.8 * k);
      displacements.emplace_back(0.5, 0.1 * std::sin(k), 0.2);
    }
  // The guide moves from tick to tick, and in the last so do landmarks. In the first the needles are loaded over so
  // much of their length that there are more columns than space, and they are added to K itself.
  for (const double guide : {109.0, 110.0, 111.0, 112.0, 112.5}) {
    const double first = guide == 109 ? 30 : 155, apart = guide == 109 ? 7.5 : 1.8;
    LandmarkCompliance compliance;
    compliance.reserve(60, 2);
    for (std::int32_t n = 0; n < 2; ++n) {
      compliance.add_beam({.length_mm = 200, .bending_stiffness_nmm2 = 15720, .guide_mm = guide});
      for (int k = 0; k < 22; ++k) compliance.add_landmark({.beam = n, .arc_mm = first + apart * k});
    }
    if (guide == 112.5) positions.back().z() += 0.3;
    std::vector<Vec3> forces(positions.size()), as_rigid(positions.size()), left = displacements;
    bends.assign(positions, {}, {}, compliance);
    ASSERT_TRUE(bending.factorize(bends));
    bending.solve(displacements, forces);
    compliance.subtract(forces, left);
    stays.assign(positions);
    ASSERT_TRUE(rigid.factorize(stays));
    rigid.solve(left, as_rigid);
    double largest = 0, bent = 0;
    for (std::size_t i = 0; i < forces.size(); ++i) {
      largest = std::max(largest, forces[i].norm());
      bent = std::max(bent, (left[i] - displacements[i]).norm());
    }
    EXPECT_GT(bent, 0.2);
    for (std::size_t i = 0; i < forces.size(); ++i)
      EXPECT_LT((forces[i] - as_rigid[i]).norm(), 0.005 * largest) << guide << ' ' << i;
  }
}

}  // namespace
}  // namespace brachy
