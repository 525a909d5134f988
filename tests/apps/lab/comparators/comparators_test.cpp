// Each comparator against a known solution: a wrong one would make our models look better than they are.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "apps/lab/comparators/chainmail.h"
#include "apps/lab/comparators/global_spline.h"
#include "apps/lab/comparators/mass_spring.h"
#include "apps/lab/comparators/paper_csrbf.h"
#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"

namespace brachy {
namespace {

std::vector<Vec3> random_points(std::size_t n, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> at(-0.5 * size, 0.5 * size);
  std::vector<Vec3> points(n);
  for (Vec3& p : points) p = Vec3(at(random), at(random), at(random));
  return points;
}

ElasticBody gland() {
  ElasticBody body;
  body.box_size = Vec3(96, 96, 96);
  body.needle_radius = 2;
  body.regions = {std::make_shared<EllipsoidRegion>(Vec3::Zero(), Vec3(24, 18, 21), 6e-3)};
  return body;
}

Eigen::Matrix<double, Eigen::Dynamic, 3> rows(const std::vector<Vec3>& v) {
  Eigen::Matrix<double, Eigen::Dynamic, 3> m(static_cast<Eigen::Index>(v.size()), 3);
  for (std::size_t i = 0; i < v.size(); ++i) m.row(static_cast<Eigen::Index>(i)) = v[i].transpose();
  return m;
}

TEST(ThinPlate, ReproducesAffineMaps) {
  const auto positions = random_points(12, 40, 1), at = random_points(30, 90, 2);
  Mat3 A;
  A << 0.1, -0.2, 0.05, 0.3, 0.02, -0.1, 0.0, 0.15, -0.07;
  const Vec3 b(1, -2, 3);
  std::vector<Vec3> d;
  for (const Vec3& p : positions) d.push_back(A * p + b);
  const Eigen::MatrixXd u =
      SplineMap(SplineBasis::thin_plate(), positions, positions.size()).influence(at) * rows(d);
  for (std::size_t i = 0; i < at.size(); ++i)
    EXPECT_LT((u.row(static_cast<Eigen::Index>(i)).transpose() - (A * at[i] + b)).norm(), 1e-10);
}

// Away from the landmarks Δ²u = 0. By hand, landmarks on a line at z = −1, 0, 1 with d = 0, 1, 0, φ = r, p = c + bz:
// the side conditions leave α = (s, −2s, s); u(0) = 2s + c = 1 and u(1) = 2s − 2s + c = 0: u = ½|x + e| − |x| + ½|x −
// e|.
TEST(ThinPlate, IsTheBiharmonicSolutionOfThreeLandmarks) {
  const SplineMap map(SplineBasis::thin_plate(), {{0, 0, -1}, {0, 0, 0}, {0, 0, 1}}, 3);
  for (const Vec3& x : random_points(40, 6, 3)) {
    const double exact = 0.5 * (x + Vec3::UnitZ()).norm() - x.norm() + 0.5 * (x - Vec3::UnitZ()).norm();
    EXPECT_NEAR(map.influence(std::vector{x})(0, 1), exact, 1e-12);
  }
  // Δ² by differences of a field with many landmarks.
  const SplineMap many(SplineBasis::thin_plate(), random_points(8, 10, 4), 8);
  constexpr double kH = 0.5;
  const auto value = [&](const Vec3& x) { return many.influence(std::vector{x})(0, 0); };
  const auto laplacian = [&](const Vec3& x) {
    double sum = -6 * value(x);
    for (int k = 0; k < 3; ++k) sum += value(x + kH * Vec3::Unit(k)) + value(x - kH * Vec3::Unit(k));
    return sum / (kH * kH);
  };
  const Vec3 far(14, -11, 9);
  double bilaplacian = -6 * laplacian(far);
  for (int k = 0; k < 3; ++k)
    bilaplacian += laplacian(far + kH * Vec3::Unit(k)) + laplacian(far - kH * Vec3::Unit(k));
  EXPECT_NEAR(bilaplacian / (kH * kH), 0, 1e-6);
}

TEST(ThinPlate, OfAStraightShaftMovesEverythingWithItUnlessTheWallsHold) {
  ComparedScene scene{gland(), {}, random_points(50, 80, 5)};
  for (int i = 0; i < 6; ++i) scene.landmarks.emplace_back(0, 0, 4 - 3 * i);
  const std::vector<Vec3> d(6, Vec3(2, 0, 0));
  std::vector<Vec3> u(scene.points.size());
  GlobalSpline bare(SplineBasis::thin_plate(), false), held(SplineBasis::thin_plate(), true);
  for (GlobalSpline* model : {&bare, &held}) {
    model->set_up(scene);
    model->tick(d);
    EXPECT_LT((model->displacements_at(std::vector{scene.landmarks[2]})[0] - d[2]).norm(), 1e-5);
  }
  bare.read(u);
  for (const Vec3& v : u) EXPECT_LT((v - d[0]).norm(), 1e-5);
  EXPECT_EQ(wall_points(scene.body).size(), 150u);
  for (const Vec3& v : held.displacements_at(wall_points(scene.body))) EXPECT_LT(v.norm(), 1e-6);
  held.read(u);
  const auto exact = held.displacements_at(scene.points);
  for (std::size_t i = 0; i < u.size(); ++i) EXPECT_LT((u[i] - exact[i]).norm(), 1e-5);
}

TEST(ThinPlate, RefusesTheSamePlaceTwice) {
  EXPECT_THROW(SplineMap(SplineBasis::thin_plate(), {{0, 0, 1}, {0, 0, 1}, {1, 2, 3}}, 3),
               std::runtime_error);
}

TEST(Multiquadric, InterpolatesAndConverges) {
  const auto wave = [](const Vec3& x) {
    return std::sin(0.1 * x.x()) * std::cos(0.07 * x.y()) + 0.02 * x.z();
  };
  double last = 4;
  for (const int n : {3, 5, 9}) {
    std::vector<Vec3> grid;
    for (int i = 0; i < n * n * n; ++i)
      grid.push_back(Vec3(i % n, i / n % n, i / n / n) * (40.0 / (n - 1)) - Vec3::Constant(20));
    Eigen::VectorXd values(n * n * n);
    for (int i = 0; i < values.size(); ++i) values[i] = wave(grid[static_cast<std::size_t>(i)]);
    const SplineMap map(SplineBasis::multiquadric(8), grid, grid.size());
    EXPECT_LT((map.influence(grid) * values - values).lpNorm<Eigen::Infinity>(), 1e-6);
    const auto at = random_points(60, 30, 6);
    const Eigen::VectorXd found = map.influence(at) * values;
    double error = 0;
    for (std::size_t i = 0; i < at.size(); ++i)
      error = std::max(error, std::abs(found[static_cast<Eigen::Index>(i)] - wave(at[i])));
    EXPECT_LT(error, last / 8) << n << " points a side";
    last = error;
  }
}

// A uniform strain at the faces: inside, the exact linear answer is the same strain, and the faces' forces are those of
// a solid with λ = μ.
TEST(MassSpring, KeepsAUniformStrainAndItsStress) {
  const double modulus = 5e-3;
  const Lattice lattice(Vec3::Zero(), Vec3(24, 16, 20), 4);
  SpringLattice springs(lattice, [&](const Vec3&) { return modulus; });
  Mat3 strain;
  strain << 0.02, 0.01, 0, 0.01, -0.005, 0.004, 0, 0.004, 0.01;
  const auto on_face = [&](std::size_t node) {
    const auto p = lattice.place(node);
    for (std::size_t a = 0; a < 3; ++a)
      if (p[a] == 0 || p[a] + 1 == lattice.count()[a]) return true;
    return false;
  };
  for (std::size_t node = 0; node < lattice.size(); ++node)
    if (on_face(node)) springs.prescribe(node, strain * lattice.position(node));
  springs.advance(1);
  Vec3 force = Vec3::Zero();
  for (std::size_t node = 0; node < lattice.size(); ++node) {
    for (std::size_t a = 0; a < 3; ++a)
      EXPECT_NEAR(springs.displacements()[a][node],
                  (strain * lattice.position(node))[static_cast<Eigen::Index>(a)], 1e-5);
    if (lattice.place(node)[2] + 1 == lattice.count()[2]) force -= springs.spring_force(node);
  }
  const Mat3 stress = modulus * strain.trace() * Mat3::Identity() + 2 * modulus * strain;
  EXPECT_LT((force - stress.col(2) * 24 * 16).norm(), 1e-4 * force.norm());
}

// Two layers in series, stretched without moving sideways: C11 = 3μ, so the strains are as 1/μ.
TEST(MassSpring, SharesAStretchBetweenLayersByTheirModuli) {
  const Lattice lattice(Vec3::Zero(), Vec3(16, 16, 32), 4);
  SpringLattice springs(lattice, [](const Vec3& X) { return X.z() < 0 ? 2e-3 : 6e-3; });
  const auto exact = [](const Vec3& X) { return Vec3(0, 0, X.z() < 0 ? 0.03 * X.z() : 0.01 * X.z()); };
  for (std::size_t node = 0; node < lattice.size(); ++node) {
    const auto p = lattice.place(node);
    if (p[0] == 0 || p[0] == 4 || p[1] == 0 || p[1] == 4 || p[2] == 0 || p[2] == 8)
      springs.prescribe(node, exact(lattice.position(node)));
  }
  springs.advance(1);
  for (std::size_t node = 0; node < lattice.size(); ++node)
    EXPECT_NEAR(springs.displacements()[2][node], exact(lattice.position(node)).z(), 1e-5);
}

// The highest mode of planes that move against each other along x: each node is pulled by two edges of stiffness k and
// by eight diagonals of which k/2 counts along x, all twice as long as its own displacement.
TEST(MassSpring, StepsBelowTheLimitOfItsHighestMode) {
  const double modulus = 6e-3, h = 4, k = modulus * h, m = SpringLattice::kDensity * h * h * h;
  const SpringLattice springs(Lattice(Vec3::Zero(), Vec3::Constant(40), h),
                              [&](const Vec3&) { return modulus; });
  const double omega = std::sqrt(2 * (2 * k + 8 * k / 2) / m);  // u_x alternates from plane to plane
  EXPECT_LE(springs.largest_step(), 2 / omega);
  EXPECT_GT(springs.largest_step(), 1 / omega);
}

TEST(MassSpring, OfASceneComesToRestWithItsNeedleAndWallsWhereTheyBelong) {
  ComparedScene scene{gland(), {{0, 0, 0}, {0, 0, -8}}, random_points(20, 40, 7)};
  scene.points.push_back(Vec3::Zero());
  MassSpring model(8);
  model.set_up(scene);
  const std::vector<Vec3> d(2, Vec3(0, 0, 3));
  std::vector<Vec3> before(21), u(21);
  for (int tick = 0; tick < 100; ++tick) {
    before = u;
    model.tick(d);
    model.read(u);
  }
  for (std::size_t i = 0; i < u.size(); ++i) EXPECT_LT((u[i] - before[i]).norm(), 1e-4);
  EXPECT_LT((u.back() - d[0]).norm(), 1e-5);
  EXPECT_LT(model.displacements_at(wall_points(scene.body))[7].norm(), 1e-6);
}

// A chain of links 4 mm long and a tenth slack: dragged by 1 mm, the k-th link follows by 1 − 0.4 k until it is slack.
TEST(ChainMail, LinksFollowByWhatTheirNeighboursAreNotSlack) {
  const Lattice lattice(Vec3::Zero(), Vec3(40, 40, 40), 4);
  ChainMailLattice mail(lattice, {});
  const std::size_t middle = lattice.nearest(Vec3::Zero());
  mail.deform(std::vector<ChainMailLattice::Move>{{middle, Vec3(0, 0, 1)}});
  for (std::size_t node = 0; node < lattice.size(); ++node) {
    const double links = lattice.position(node).lpNorm<1>() / 4;
    EXPECT_NEAR(mail.displacements()[2][node], std::max(0.0, 1 - 0.4 * links), 1e-6);
    EXPECT_EQ(mail.displacements()[0][node], 0);
  }
  mail.deform(std::vector<ChainMailLattice::Move>{{middle, Vec3::Zero()}});
  for (const float u : mail.displacements()[2]) EXPECT_EQ(u, 0) << "back at rest";
}

TEST(ChainMail, HasLimitsOfItsOwnForPushPullAndShear) {
  const Lattice lattice(Vec3::Zero(), Vec3(40, 4, 4), 4);
  ChainMailLattice mail(lattice, {.least = 0.7, .most = 1.1, .shear = 0.2});
  const auto at = [&](double x) { return lattice.nearest(Vec3(x, 2, 2)); };
  const std::array<double, 3> ahead = {2 - 1.2, 0, 0}, behind = {2 - 0.4, 2 - 0.8, 2 - 1.2};
  mail.deform(std::vector<ChainMailLattice::Move>{{at(0), Vec3(2, 0, 0)}});
  EXPECT_NEAR(mail.displacements()[0][at(4)], ahead[0], 1e-6) << "pushed";
  EXPECT_NEAR(mail.displacements()[0][at(8)], ahead[1], 1e-6);
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(mail.displacements()[0][at(-4 * (i + 1))], behind[static_cast<std::size_t>(i)], 1e-6)
        << "pulled";
  mail.deform(std::vector<ChainMailLattice::Move>{{at(0), Vec3(0, 2, 0)}});
  EXPECT_NEAR(mail.displacements()[1][at(4)], 2 - 0.8, 1e-6) << "sideways";
}

TEST(ChainMail, DoesNotMoveWhatIsHeld) {
  ComparedScene scene{gland(), {{0, 0, -44}}, {Vec3(0, 0, -48), Vec3(0, 0, -40)}};
  ChainMail model(4);
  model.set_up(scene);
  model.tick(std::vector<Vec3>{Vec3(3, 0, 0)});
  std::vector<Vec3> u(2);
  model.read(u);
  EXPECT_EQ(u[0], Vec3::Zero());
  EXPECT_NEAR(u[1].x(), 2.6, 1e-6);
}

// A landmark that moves to other nodes moves those, and releases the ones before.
TEST(Lattices, FollowALandmarkThatMovesOn) {
  ComparedScene scene{gland(), {{0, 0, -16}}, {Vec3(0, 0, -16), Vec3(0, 0, 16)}};
  ChainMail mail(8);
  MassSpring springs(8);
  for (ComparedModel* model : std::initializer_list<ComparedModel*>{&mail, &springs}) {
    model->set_up(scene);
    const std::vector<Vec3> d = {Vec3(1, 0, 0)};
    std::vector<Vec3> u(2);
    model->tick(d);
    ASSERT_TRUE(model->move(std::vector<Vec3>{{0, 0, 16}}));
    for (int tick = 0; tick < 60; ++tick) model->tick(d);
    model->read(u);
    EXPECT_NEAR(u[1].x(), 1, 1e-6);
    EXPECT_LT(u[0].norm(), 0.3);
  }
}

TEST(PaperCsrbf, EqualsTheEnginesField) {
  ComparedScene scene{gland(), {{0, 0, 4}, {0, 0, 1}, {0, 0, -2}}, random_points(60, 50, 8)};
  const std::vector<Vec3> d(3, Vec3(1, 0, 2));
  const auto anchors = paper_anchors(scene.body, scene.landmarks);
  ASSERT_GE(anchors.size(), 6u);
  std::vector<Vec3> positions = scene.landmarks, moved = d;
  for (const Vec3& anchor : anchors) {
    const Vec3 share = anchor.cwiseQuotient(Vec3(24, 18, 21));
    EXPECT_NEAR(share.norm(), 0.5, 0.01);
    positions.push_back(anchor);
    moved.push_back(Vec3::Zero());
  }
  for_each_kernel([&](auto kernel) {
    PaperCsrbf model(kernel, 12);
    model.set_up(scene);
    model.tick(d);
    std::vector<Vec3> u(scene.points.size());
    model.read(u);
    RbfSystem system(kernel, 12, static_cast<int>(positions.size()));
    ASSERT_TRUE(system.factorize(positions));
    std::vector<Vec3> weights(positions.size());
    system.solve(moved, weights);
    const RbfField field{kernel, 12, positions, weights};
    const auto det = model.jacobians(scene.points);
    const auto by_differences =
        static_cast<const ComparedModel&>(model).ComparedModel::jacobians(scene.points);
    for (std::size_t i = 0; i < u.size(); ++i) {
      EXPECT_LT((u[i] - field.displacement(scene.points[i])).norm(), 1e-9) << kernel.kName;
      EXPECT_NEAR(det[i], field.jacobian(scene.points[i]), 1e-9) << kernel.kName;
      EXPECT_NEAR(by_differences[i], det[i], 1e-4) << kernel.kName;
    }
  });
}

}  // namespace
}  // namespace brachy
