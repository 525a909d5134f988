// Landmarks with their own core radius, such as a needle's tip, on the models that use it.
#include <gtest/gtest.h>

#include "core/models/guard/guarded_field.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "tests/core/models/blocks/reactions.h"
#include "tests/core/models/blocks/small_tissue.h"
#include "tests/core/models/matrix_kernel/accurate_models.h"

namespace brachy {
namespace {

const Tissue& cored_phantom() {
  static const Tissue tissue = test::small_phantom(Vec3::Zero());
  return tissue;
}

class CoredLandmark : public testing::TestWithParam<const char*> {};

TEST_P(CoredLandmark, TissueAtItGoesAsFarAsItDoes) {
  MatrixKernelField field(cored_phantom(), GetParam(), {}, {});
  for (const double core : {2.0, 5.0, 10.0})
    for (const Vec3& p : {Vec3(0, 0, 0), Vec3(5, -3, -12), Vec3(-8, 4, 9)}) {
      const std::vector<Vec3> at = {p}, d = {{0.5, 0, 2}};
      const std::vector<double> cores = {core};
      const std::vector<LandmarkSpread> spreads = {{.core_mm = core}};
      ASSERT_TRUE(field.update(LandmarkSet::of(at, d, spreads)));
      EXPECT_LT((field.displacement_at(p) - d[0]).norm(), 0.01 * d[0].norm()) << core;
      MatrixKernelSystem exact(field.kernel());
      ASSERT_TRUE(exact.factorize(at, cores));
      const Vec3 force = exact.solve(d)[0];
      EXPECT_LT((field.forces()[0] - force).norm(), 0.01 * force.norm()) << core;
    }
}

// As a contact's: it takes the force of its law, and the tissue goes all the way with it. Depths of the capsule's law
// from the first touch to the puncture, at places on the surface and within.
TEST_P(CoredLandmark, YieldsAsItsStiffnessSays) {
  MatrixKernelField field(cored_phantom(), GetParam(), {}, {});
  const Vec3 axis = Vec3(0.1, -0.2, 1).normalized();
  for (const double k : {0.301, 0.4, 0.6, 0.75})
    for (const std::size_t i :
         {std::size_t{0}, std::size_t{70}, std::size_t{170}, cored_phantom().size() - 1}) {
      const Vec3 p = cored_phantom().rest_vertices[i], d = 3 * axis;
      const std::vector<LandmarkSpread> spreads = {{.stiffness_n_per_mm = k, .axis = axis}};
      ASSERT_TRUE(field.update(LandmarkSet::of({&p, 1}, {&d, 1}, spreads)));
      MatrixKernelSystem exact(field.kernel());
      ASSERT_TRUE(exact.factorize({&p, 1}, field.cores()));
      EXPECT_NEAR(axis.dot(exact.matrix() * axis), 1 / k, 0.02 / k) << k << " at " << p.transpose();
      EXPECT_LT((field.displacement_at(p) - d).norm(), 0.01 * d.norm()) << k << " at " << p.transpose();
    }
}

// Stiffer than any tissue: the widest core, and a system that can be solved.
TEST_P(CoredLandmark, AStiffnessBeyondTheTissuesIsThatOfTheWidestCore) {
  MatrixKernelField field(cored_phantom(), GetParam(), {}, {});
  for (std::size_t i = 0; i < cored_phantom().size(); i += 37) {
    const Vec3 p = cored_phantom().rest_vertices[i];
    double core = 0;
    for (const double k : {2.0, 10.0, 1e6}) {
      const std::vector<LandmarkSpread> spreads = {{.stiffness_n_per_mm = k, .axis = Vec3::UnitZ()}};
      ASSERT_TRUE(field.factorize(LandmarkSet::of({&p, 1}, {}, spreads))) << k << " at " << p.transpose();
      if (k > 10) {
        EXPECT_EQ(field.cores()[0], core) << p.transpose();
      }
      core = field.cores()[0];
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Models, CoredLandmark, testing::ValuesIn(test::accurate_models()),
                         [](const auto& model_name) { return model_name.param; });

struct CoredPush {
  std::vector<Vec3> positions, displacements;
  std::vector<LandmarkSpread> spreads;
};

CoredPush lone(double core, double d) {
  return {{{0, 0, 0}}, {d * Vec3(0, 0.6, 0.8)}, {{.core_mm = core}}};
}

// A shaft of rings 5 mm apart and its tip, ahead of the last one by `ahead`.
CoredPush shaft_and_tip(int shaft, double ahead, double core) {
  CoredPush push;
  const Vec3 axis = Vec3(0.1, 0, 1).normalized();
  for (int k = 0; k < shaft; ++k) push.positions.push_back(Vec3(3, -2, -16) + 5.0 * k * axis);
  push.positions.push_back(push.positions.back() + ahead * axis);
  push.spreads.resize(push.positions.size());
  push.spreads.back().core_mm = core;
  push.displacements.assign(push.positions.size(), 1.5 * axis);
  return push;
}

// Across a needle its tip is as thick as its shaft; along it, the tip's force is spread.
TEST(CoredLandmarkField, ATipThatContinuesAShaftHasItsCoreAlongOnly) {
  MatrixKernelField field(cored_phantom(), "elastic", {}, {});
  const Vec3 axis = Vec3(0.1, 0, 1).normalized(), across = axis.cross(Vec3::UnitY());
  CoredPush push = shaft_and_tip(5, 4, 12);
  const auto stiffness = [&](std::span<const LandmarkSpread> spreads, const Vec3& direction) {
    const std::vector<Vec3> d(push.positions.size(), direction);
    std::vector<Vec3> f(d.size());
    EXPECT_TRUE(field.factorize(LandmarkSet::of(push.positions, {}, spreads)));
    field.solve(d, f);
    double sum = 0;
    for (const Vec3& force : f) sum += direction.dot(force);
    return sum;
  };
  const double shaft_alone = stiffness({}, across), apart = stiffness(push.spreads, across),
               apart_along = stiffness(push.spreads, axis);
  push.spreads.back().behind = 4;
  EXPECT_NEAR(stiffness(push.spreads, across), shaft_alone, 0.02 * shaft_alone);
  EXPECT_GT(apart, 1.3 * shaft_alone);
  EXPECT_NEAR(stiffness(push.spreads, axis), apart_along, 0.1 * apart_along);
}

// Whatever is said of tips: a shaft ends where its tip goes on, also where another needle's lies ahead on its line.
TEST(NeedleRings, CarryTheForceOfEachLandmark) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 500; ++i) {
    std::vector<Vec3> positions;
    std::vector<double> cores;
    std::vector<LandmarkSpread> spreads;
    for (int l = 0; l < 9; ++l) {
      positions.push_back(Vec3(0, 0, 4.0 * l) + test::uniform_point(random, 1));
      cores.push_back(random() % 3 == 0 ? 8 : 0);
      spreads.push_back({.core_mm = cores.back(), .behind = static_cast<std::int32_t>(random() % 11) - 1});
    }
    NeedleRings rings;
    rings.build(positions, cores, 0.635, spreads);
    std::vector<double> across(positions.size(), 0), along = across, smooth = across;
    for (const NeedleRings::Ring& ring : rings.rings())
      for (std::size_t side = 0; side < 2; ++side) {
        across[ring.landmark[side]] += ring.across[side];
        along[ring.landmark[side]] += ring.along[side];
        smooth[ring.landmark[side]] += ring.smooth[side];
      }
    for (std::size_t l = 0; l < positions.size(); ++l) {
      ASSERT_NEAR(across[l], 1, 1e-12) << i << ": " << l;
      ASSERT_NEAR(along[l], 1, 1e-12) << i << ": " << l;
      ASSERT_NEAR(smooth[l], 1, 1e-12) << i << ": " << l;
    }
  }
}

TEST(CoredLandmarkField, BlocksAndGradientsAreThoseOfTheSinglePoints) {
  MatrixKernelField field(cored_phantom(), "elastic", {}, {});
  for (const CoredPush& push : {lone(5, 3), shaft_and_tip(5, 4, 8)}) {
    ASSERT_TRUE(field.update(LandmarkSet::of(push.positions, push.displacements, push.spreads)));
    for (const std::uint32_t b : field.touched()) {
      const Block& block = cored_phantom().blocks[b];
      const BlockDisplacement<float>& u = field.displacement(b);
      for (std::uint32_t i = 0; i < block.count; i += 5)
        ASSERT_LT((Vec3(u.ux[i], u.uy[i], u.uz[i]) -
                   field.displacement_at(cored_phantom().rest_vertices[block.first + i]))
                      .norm(),
                  1e-3);
    }
    constexpr double kStep = 1e-3;
    const CellField& cells = field.cells();
    std::mt19937_64 random(3);
    for (int i = 0; i < 100; ++i) {
      const Vec3 X = push.positions.back() + test::uniform_point(random, 9);
      if (!cells.covers(X)) continue;
      Mat3 A;
      for (int k = 0; k < 3; ++k)
        A.col(k) = (field.displacement_at(X + kStep * Vec3::Unit(k)) -
                    field.displacement_at(X - kStep * Vec3::Unit(k))) /
                   (2 * kStep);
      ASSERT_LT((cells.gradient(X) - A).norm(), 2e-3) << X.transpose();
    }
  }
}

// The least det(I + ∇u) along the push.
double least_determinant(MatrixKernelField& field, const Vec3& axis, double core) {
  const CellField& cells = field.cells();
  double least = 1;
  for (double r = 0; r < 3 * core; r += 0.01 * core)
    for (const double side : {-r, r})
      least = std::min(least, (Mat3::Identity() + cells.gradient(side * axis)).determinant());
  return least;
}

// core/DESIGN.md, section 4: at 2.57 cores in an unbounded solid, which is a force of 32 μ ε²; in a box, which carries
// part of the force, at the same force and a somewhat smaller displacement.
TEST(CoredLandmarkField, FoldsAtTheForceOfTwoAndAHalfCores) {
  const auto make = [] {
    return std::make_unique<MatrixKernelField>(cored_phantom(), "elastic", ElasticBody{},
                                               MatrixKernelField::Options{});
  };
  const auto field = make();
  GuardedField guarded(cored_phantom(), make(), nullptr, {.policy = "flag"});
  for (const double core : {2.0, 5.0}) {
    SCOPED_TRACE(core);
    double none = 1, folded = 4;  // cores
    while (folded - none > 1e-3) {
      const double d = 0.5 * (none + folded);
      const CoredPush push = lone(core, d * core);
      ASSERT_TRUE(field->update(LandmarkSet::of(push.positions, push.displacements, push.spreads)));
      (least_determinant(*field, push.displacements[0].normalized(), core) > 0 ? none : folded) = d;
    }
    EXPECT_NEAR(field->total_force_n() / (ElasticBody{}.shear_modulus * core * core), 32, 0.5);
    EXPECT_LT(folded, 2.57);
    EXPECT_GT(folded, core < 3 ? 2.4 : 2.2);
    const auto verdict_at = [&](double d) {
      const CoredPush push = lone(core, d * core);
      EXPECT_TRUE(guarded.update(LandmarkSet::of(push.positions, push.displacements, push.spreads)));
      return guarded.certificate().verdict;
    };
    EXPECT_EQ(verdict_at(0.7 * folded), Verdict::kInjective);
    EXPECT_NE(verdict_at(0.97 * folded), Verdict::kFolded);
    EXPECT_EQ(verdict_at(1.03 * folded), Verdict::kFolded);
    EXPECT_EQ(verdict_at(2.8), Verdict::kFolded);
  }
}

// A tip a little ahead of its shaft, its core reaching back over the last rings.
TEST(CoredLandmarkField, AShaftWithATipOfItsOwnIsWellConditionedAndSane) {
  MatrixKernelField field(cored_phantom(), "elastic", {}, {});
  for (const int shaft : {1, 2, 6})
    for (const double ahead : {2.5, 5.0, 7.5})
      for (const double core : {6.0, 8.0, 10.0}) {
        SCOPED_TRACE(testing::Message() << shaft << " " << ahead << " " << core);
        const CoredPush push = shaft_and_tip(shaft, ahead, core);
        ASSERT_TRUE(field.update(LandmarkSet::of(push.positions, push.displacements, push.spreads)));
        EXPECT_LT(field.condition(), 50);
        const double pushed = push.displacements.back().norm();
        EXPECT_NEAR(field.displacement_at(push.positions.back()).norm(), pushed, 0.12 * pushed);
        for (const std::uint32_t b : field.touched())
          for (std::uint32_t i = 0; i < cored_phantom().blocks[b].count; ++i) {
            const BlockDisplacement<float>& u = field.displacement(b);
            ASSERT_LT(Vec3(u.ux[i], u.uy[i], u.uz[i]).norm(), 1.05 * pushed);
          }
        // The tip carries most of the push; the shaft behind it almost nothing, and hardly any tension.
        std::vector<Vec3> f(push.positions.size());
        field.solve(push.displacements, f);
        const Vec3 axis = push.displacements.back().normalized();
        for (const Vec3& each : f) EXPECT_GT(each.dot(axis), -0.1 * f.back().dot(axis));
        EXPECT_GT(f.back().dot(axis), 0.6 * field.total_force_n());
      }
}

// Cores of 0 leave K unchanged: rings by the kernel's default.
TEST(CoredLandmarkField, OnlyLandmarksWithACoreAreSeenWithAllOfIt) {
  NeedleRings rings;
  const CoredPush push = shaft_and_tip(3, 5, 8);
  rings.build(push.positions, std::vector<double>{0, 0, 0, 8}, 0.635);
  for (const NeedleRings::Ring& ring : rings.rings())
    EXPECT_EQ(ring.core.with(ring.core), ring.count == 1 ? ring.core.s : 2 * ring.core.s);
  EXPECT_EQ(rings.rings().back().core.s, 64);
  EXPECT_EQ(rings.rings().back().core.with(PointCore::of_landmark(5)), 64);
  rings.build(std::span(push.positions).first(1), {}, 0.635);
  EXPECT_EQ(rings.rings()[0].core, PointCore::of_surface(rings.rings()[0].core.s));
}

// The tip's force, by far the largest, carries the tissue on the shaft as far as K says. The tip itself is missed by
// what the shaft's forces do within its core.
TEST_P(CoredLandmark, AShaftBehindItGoesAsFarAsItDoes) {
  MatrixKernelField field(cored_phantom(), GetParam(), {}, {});
  const CoredPush push = shaft_and_tip(4, 4, 8);
  const Vec3 axis = push.displacements[0].normalized();
  // The tip pushes, and what lies behind is carried along by it and by friction of 0.1 N.
  ASSERT_TRUE(field.factorize(LandmarkSet::of(push.positions, {}, push.spreads)));
  std::vector<Vec3> axes(push.positions.size(), axis);
  Eigen::MatrixXd H(push.positions.size(), push.positions.size());
  field.axial_stiffness(0, axes, H);
  Eigen::VectorXd forces = Eigen::VectorXd::Constant(H.rows(), 0.1);
  forces[H.rows() - 1] = 3;
  const Eigen::VectorXd along = H.inverse() * forces;
  std::vector<Vec3> d;
  for (Eigen::Index i = 0; i < along.size(); ++i) d.push_back(along[i] * axis);
  ASSERT_TRUE(field.update(LandmarkSet::of(push.positions, d, push.spreads)));
  for (std::size_t i = 0; i < d.size(); ++i)
    EXPECT_LT((field.displacement_at(push.positions[i]) - d[i]).norm(), 0.06 * d.back().norm()) << i;
}

}  // namespace
}  // namespace brachy
