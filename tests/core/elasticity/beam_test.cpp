// Needles as beams against closed forms (S. Timoshenko, Strength of Materials I and II; M. Hetényi, Beams on Elastic
// Foundation, 1946), and what they add to the tissue's compliance.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>
#include <random>

#include "core/elasticity/beam.h"
#include "core/elasticity/beam_columns.h"
#include "core/elasticity/kelvin.h"
#include "core/elasticity/landmark_compliance.h"
#include "tests/core/elasticity/symmetric_eigenvalues.h"
#include "tests/core/solve/random_landmarks.h"
#include "tests/sanitized.h"

namespace brachy {
namespace {

Beam eighteen_gauge() {
  return {.length_mm = 200, .bending_stiffness_nmm2 = 15720};
}

TEST(Beam, HasTheBendingStiffnessOfItsTube) {
  EXPECT_NEAR(Beam::bending_stiffness(200, 1.27, 1.0), 15720, 10);
  EXPECT_NEAR(Beam::bending_stiffness(200, 1.27, 0), 25540, 10);
  EXPECT_NEAR(Beam::bending_stiffness(191, 0.91, 0), 6441, 30);  // 20 G
}

TEST(Beam, BendsAsACantilever) {
  const Beam beam = eighteen_gauge();
  const double stiffness = beam.bending_stiffness_nmm2, L = beam.length_mm;
  EXPECT_NEAR(beam.compliance(L, L), L * L * L / (3 * stiffness), 1e-9);
  EXPECT_NEAR(beam.slope_compliance(L, L), L * L / (2 * stiffness), 1e-12);
  // Loaded at a: the end goes a²(3L − a)/6EI, with the slope at the load.
  EXPECT_NEAR(beam.compliance(L, 80), 80.0 * 80 * (3 * L - 80) / (6 * stiffness), 1e-9);
  EXPECT_NEAR(beam.slope_compliance(L, 80), 80.0 * 80 / (2 * stiffness), 1e-12);
  EXPECT_EQ(beam.compliance(80, 130), beam.compliance(130, 80));
  for (const double s : {10.0, 60.0, 120.0, 190.0}) {
    const double h = 1e-4, slope = (beam.compliance(s + h, 120.5) - beam.compliance(s - h, 120.5)) / (2 * h);
    EXPECT_NEAR(beam.slope_compliance(s, 120.5), slope, 1e-7 * (1 + std::abs(slope))) << s;
  }
}

TEST(Beam, TurnsWithTheHand) {
  Beam beam = eighteen_gauge();
  const double fixed = beam.compliance(150, 200);
  beam.hand_rad_per_nmm = 1e-4;
  EXPECT_NEAR(beam.compliance(150, 200) - fixed, 150 * 200 * 1e-4, 1e-9);
}

TEST(Beam, IsHeldByItsGuide) {
  Beam beam = eighteen_gauge();
  beam.guide_mm = 120;
  const double a = 80, z = 120, stiffness = beam.bending_stiffness_nmm2;
  EXPECT_NEAR(beam.compliance(120, 200), 0, 1e-9);
  // Clamped, propped at z, loaded at the end of the overhang a: P a²(3z + 4a)/12EI.
  EXPECT_NEAR(beam.compliance(200, 200), a * a * (3 * z + 4 * a) / (12 * stiffness), 1e-9);
  EXPECT_NEAR(beam.guide_share(200), 1 + 1.5 * a / z, 1e-12);  // the prop's reaction
  EXPECT_NEAR(beam.guide_share(120), 1, 1e-12);
}

// A long beam on springs of k N/mm per mm, pushed aside at its end: w = 2Fβ/k there, β = (k/4EI)^¼, and the moment that
// an opposed pair would take vanishes.
TEST(Beam, OnAnElasticFoundationBendsByWinklersClosedForm) {
  Beam beam = eighteen_gauge();
  for (const double k : {0.002, 0.02, 0.2}) {
    const double beta = std::pow(k / (4 * beam.bending_stiffness_nmm2), 0.25), force = 0.3;
    beam.length_mm = 8 / beta;
    const Eigen::Index n = 400;
    const double h = beam.length_mm / n;
    Eigen::MatrixXd K = Eigen::MatrixXd::Identity(n, n) / (k * h);
    Eigen::VectorXd d(n);
    const auto arc = [&](Eigen::Index i) { return beam.length_mm - (static_cast<double>(i) + 0.5) * h; };
    for (Eigen::Index i = 0; i < n; ++i) {
      d[i] = force * beam.compliance(arc(i), beam.length_mm);
      for (Eigen::Index j = 0; j < n; ++j) K(i, j) += beam.compliance(arc(i), arc(j));
    }
    const Eigen::VectorXd f = K.llt().solve(d);
    double end = force * beam.compliance(beam.length_mm, beam.length_mm);
    for (Eigen::Index i = 0; i < n; ++i) end -= f[i] * beam.compliance(beam.length_mm, arc(i));
    EXPECT_NEAR(end, 2 * force * beta / k, 0.01 * end) << k;
    // At x from the end: e^{−βx} cos βx of it.
    const double x = 1 / beta;
    double there = force * beam.compliance(beam.length_mm - x, beam.length_mm);
    for (Eigen::Index i = 0; i < n; ++i) there -= f[i] * beam.compliance(beam.length_mm - x, arc(i));
    EXPECT_NEAR(there, end * std::exp(-1.0) * std::cos(1.0), 0.01 * end) << k;
  }
}

// Random needles in an unbounded elastic solid: K + C must factor, and by Weyl's inequality its least eigenvalue is no
// less than K's.
TEST(LandmarkCompliance, LeavesTheLandmarksSystemPositiveDefinite) {
  std::mt19937_64 random(3);
  const int count = test::kIsSanitized ? 500 : 100000;
  double largest_condition = 0;
  for (int i = 0; i < count; ++i) {
    LandmarkCompliance compliance;
    std::vector<Vec3> positions;
    const int needles = 1 + static_cast<int>(random() % 3);
    for (int k = 0; k < needles; ++k) {
      Beam beam;
      beam.axis = (Vec3::UnitZ() + test::uniform_point(random, 0.5)).normalized();
      beam.length_mm = test::uniform(random, 60, 300);
      beam.bending_stiffness_nmm2 = std::pow(10, test::uniform(random, 1, 6));
      if (random() % 2) beam.guide_mm = test::uniform(random, 1, beam.length_mm - 1);
      if (random() % 2) beam.hand_rad_per_nmm = std::pow(10, test::uniform(random, -7, -3));
      const std::int32_t number = compliance.add_beam(beam);
      const Vec3 tip = test::uniform_point(random, 20);
      const int landmarks = 1 + static_cast<int>(random() % 4);
      for (int l = 0; l < landmarks; ++l) {
        const double back = 5 * l + test::uniform(random, 0, 1);
        positions.push_back(tip - back * beam.axis + test::uniform_point(random, 0.3));
        compliance.add_landmark({number, beam.length_mm - back});
      }
    }
    positions.push_back(test::uniform_point(random, 40));  // an anchor, on no needle
    compliance.add_landmark({});
    const auto n = static_cast<Eigen::Index>(positions.size());
    Eigen::MatrixXd K(3 * n, 3 * n);
    const double core = test::uniform(random, 1, 4), modulus = 6e-3;
    for (Eigen::Index a = 0; a < n; ++a)
      for (Eigen::Index b = 0; b < n; ++b)
        K.block<3, 3>(3 * a, 3 * b) =
            kelvin(positions[static_cast<std::size_t>(a)] - positions[static_cast<std::size_t>(b)],
                   core * core, 0.49) /
            modulus;
    Eigen::MatrixXd sum = K;
    compliance.add_to(sum, 1);
    Eigen::LLT<Eigen::MatrixXd> factor(sum);
    ASSERT_EQ(factor.info(), Eigen::Success) << i;
    if (i % 100) continue;
    const Eigen::VectorXd with = test::symmetric_eigenvalues(sum), without = test::symmetric_eigenvalues(K);
    ASSERT_GE(with[0], without[0] - 1e-12 * with[3 * n - 1]) << i;
    largest_condition = std::max(largest_condition, with[3 * n - 1] / with[0]);
  }
  RecordProperty("largest_condition", std::to_string(largest_condition));
  EXPECT_LT(largest_condition, 1e10);
}

// Needles of 18 G and 20 G, free, with a hand that turns and with a guide; landmarks in any order.
TEST(BeamColumns, AreTheNeedlesCompliances) {
  LandmarkCompliance compliance;
  compliance.reserve(200, 6);
  BeamColumns columns(200);
  const Beam rigid{.length_mm = 200, .bending_stiffness_nmm2 = std::numeric_limits<double>::infinity()};
  std::vector<Beam> beams = {eighteen_gauge(), eighteen_gauge(), rigid, eighteen_gauge()};
  beams[1].guide_mm = 118;
  beams[1].axis = Vec3(1, 2, 3).normalized();
  beams[3].bending_stiffness_nmm2 = 6441;
  beams[3].hand_rad_per_nmm = 1e-4;
  beams[3].axis = Vec3::UnitX();
  for (const Beam& beam : beams) compliance.add_beam(beam);
  compliance.add_landmark({});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> arc(128, 200);
  for (int k = 0; k < 30; ++k)
    for (std::int32_t b = 0; b < 4; ++b)
      compliance.add_landmark({.beam = b, .arc_mm = k == 0 ? 128 : k == 1 ? 200 : arc(random)});
  compliance.set_body(Vec6::Constant(0.1));
  const Eigen::Index n = 3 * 121;
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n, n), others = all;
  compliance.add_to(all, 2.5);
  compliance.add_without_beams_to(others, 2.5);
  const Eigen::MatrixXd C = (all - others).selfadjointView<Eigen::Lower>();

  columns.find(compliance);
  ASSERT_EQ(columns.count(), 4u * 2 * 6);  // of 72 mm
  Eigen::MatrixXd U = Eigen::MatrixXd::Zero(n, 48);
  columns.each(2.5, [&](std::size_t landmark, std::size_t column, const Vec3& value) {
    U.block<3, 1>(static_cast<Eigen::Index>(3 * landmark), static_cast<Eigen::Index>(column)) = value;
  });
  const Eigen::MatrixXd rest = C - U * U.transpose();
  EXPECT_LT(rest.topLeftCorner(n - 3, n - 3).cwiseAbs().maxCoeff(), 2.5 * 0.0075);  // 20 G
  for (Eigen::Index l = 3; l < n; l += 12)                                          // 18 G
    EXPECT_LT(rest.block(l, l, 6, 6).cwiseAbs().maxCoeff(), 2.5 * 0.0035) << l;
  EXPECT_GT(C.cwiseAbs().maxCoeff(), 2.5 * 100);
  EXPECT_GT(test::symmetric_eigenvalues(rest).minCoeff(), -1e-9);
  const double norm = C.cwiseAbs().colwise().sum().maxCoeff() / 2.5;
  EXPECT_GT(columns.norm(), 0.99 * norm);
  EXPECT_LT(columns.norm(), 1.8 * norm);
}

TEST(BeamColumns, AreNoneWithoutNeedles) {
  LandmarkCompliance compliance;
  compliance.reserve(4, 2);
  BeamColumns columns(4);
  compliance.add_landmark({});
  columns.find(compliance);
  EXPECT_EQ(columns.count(), 0u);
  compliance.add_beam(eighteen_gauge());
  columns.find(compliance);
  EXPECT_EQ(columns.count(), 0u);
  compliance.add_landmark({.beam = 0, .arc_mm = 150});
  columns.find(compliance);
  EXPECT_EQ(columns.count(), 2u);
}

TEST(LandmarkCompliance, TakesFromDisplacementsWhatItAddsToTheMatrix) {
  LandmarkCompliance compliance;
  Beam beam = eighteen_gauge();
  beam.axis = Vec3(1, 2, 5).normalized();
  const std::int32_t a = compliance.add_beam(beam);
  beam.axis = Vec3(-1, 0, 3).normalized();
  const std::int32_t b = compliance.add_beam(beam);
  for (const LandmarkCompliance::Point& point :
       {LandmarkCompliance::Point{a, 150}, {-1, 0}, {b, 190}, {a, 200}, {b, 100}})
    compliance.add_landmark(point);
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(15, 15);
  compliance.add_to(C, 1);
  C = Eigen::MatrixXd(C.selfadjointView<Eigen::Lower>());
  const std::vector<Vec3> forces = {{1, 2, 3}, {4, 5, 6}, {-1, 0.5, 2}, {0, 1, 0}, {2, 2, -2}};
  std::vector<Vec3> displacements(5, Vec3::Ones());
  compliance.subtract(forces, displacements);
  const Eigen::Map<const Eigen::VectorXd> f(forces[0].data(), 15), d(displacements[0].data(), 15);
  EXPECT_LT((d - (Eigen::VectorXd::Ones(15) - C * f)).norm(), 1e-9 * (C * f).norm());
  EXPECT_EQ(displacements[1], Vec3::Ones());  // on no needle
}

}  // namespace
}  // namespace brachy
