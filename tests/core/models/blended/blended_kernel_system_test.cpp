#include "core/models/blended/blended_kernel_system.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <optional>

#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "core/scene/scene.h"
#include "core/solve/per_landmark_support.h"
#include "core/solve/rbf_field.h"
#include "tests/core/elasticity/symmetric_eigenvalues.h"
#include "tests/core/models/blended/random_tissues.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/sanitized.h"

namespace brachy {
namespace {

using test::RandomTissues;
using test::sphere;
using test::uniform_point;

const std::array<Kernel, 4> kKernels = {Wendland30{}, Wendland31{}, Wendland32{}, Buhmann{}};

// A solved set, with all that its field refers to.
template <class Kernels>
struct Solved {
  Solved(const TissueModel<Kernels>& model, const std::vector<Vec3>& positions,
         const std::vector<Vec3>& displacements)
      : system(model, positions.size()), weights(positions.size()) {
    status = system.factorize(positions);
    if (!status) return;
    system.solve(displacements, weights);
    field = {&model, positions, system.shares(), weights};
  }
  BlendedKernelSystem<Kernels> system;
  std::vector<Vec3> weights;
  FactorStatus status;
  HeterogeneousField<Kernels> field{};
};

TEST(BlendedKernelSystem, AThousandRandomSetsAreSolvedAndTheirLandmarksReproduced) {
  std::mt19937_64 random(2024);
  const int sets = test::kIsSanitized ? 50 : 1000;
  double worst = 0;
  std::size_t largest = 0;
  for (int k = 0; k < sets; ++k) {
    const RandomTissues set = test::random_tissues(random, kKernels[static_cast<std::size_t>(k % 4)]);
    const Solved solved(set.model, set.positions, set.displacements);
    ASSERT_TRUE(solved.status) << "set " << k << ", kernel " << name_of(set.model.kernels.psi) << ", n "
                               << set.positions.size();
    double largest_displacement = 0;
    for (const Vec3& d : set.displacements) largest_displacement = std::max(largest_displacement, d.norm());
    for (std::size_t i = 0; i < set.positions.size(); i += 5)
      worst = std::max(worst, (solved.field.displacement(set.positions[i]) - set.displacements[i]).norm() /
                                  largest_displacement);
    largest = std::max(largest, set.positions.size());
  }
  EXPECT_LT(worst, 1e-8);
  EXPECT_EQ(largest, test::kIsSanitized ? largest : 200);
}

// K_ij = ψ(|p_i − p_j|/a_j).
Eigen::MatrixXd papers_matrix(const RandomTissues& set) {
  const auto n = static_cast<Eigen::Index>(set.positions.size());
  Eigen::MatrixXd K(n, n);
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto p = static_cast<std::size_t>(i), q = static_cast<std::size_t>(j);
      const double r = (set.positions[p] - set.positions[q]).norm() / set.supports[q];
      K(i, j) = std::visit([&](auto psi) { return psi.value(r); }, set.model.kernels.psi);
    }
  return K;
}

// The determinant's sign, as a product of signs: the number itself may underflow.
double determinant_sign(const Eigen::MatrixXd& K) {
  const Eigen::PartialPivLU<Eigen::MatrixXd> factor(K);
  return static_cast<double>(factor.permutationP().determinant()) *
         factor.matrixLU().diagonal().array().sign().prod();
}

// The same sets. A negative determinant is a stronger statement than an indefinite matrix: between one support for all,
// where it is positive, and these supports, the system is singular somewhere.
TEST(BlendedKernelSystem, ThePapersRuleIsIndefiniteOnMostOfTheSameSetsAndBeyondASingularOneOnSome) {
  if (test::kIsSanitized) GTEST_SKIP() << "a thousand factorisations";
  std::mt19937_64 random(2024);
  int indefinite = 0, beyond = 0;
  std::optional<RandomTissues> smallest;
  for (int k = 0; k < 1000; ++k) {
    const RandomTissues set = test::random_tissues(random, kKernels[static_cast<std::size_t>(k % 4)]);
    const Eigen::MatrixXd K = papers_matrix(set);
    if (Eigen::LLT<Eigen::MatrixXd>(0.5 * (K + K.transpose())).info() == Eigen::Success) continue;
    ++indefinite;
    if (determinant_sign(K) > 0) continue;
    ++beyond;
    if (!smallest || set.positions.size() < smallest->positions.size()) smallest = set;
  }
  std::printf("the paper's rule on 1000 sets: %d indefinite, %d beyond a singular one\n", indefinite, beyond);
  EXPECT_GT(indefinite, 500);
  ASSERT_GE(beyond, 1);

  // On the path from one support for all, a_j = a (a_j/a)^t, the LU factorization reaches the singular one and refuses.
  RandomTissues& set = *smallest;
  const std::vector<double> supports = set.supports;
  double regular = 0, past = 1;
  while (past - regular > 1e-15) {
    const double t = 0.5 * (regular + past);
    for (std::size_t i = 0; i < supports.size(); ++i)
      set.supports[i] = supports[0] * std::pow(supports[i] / supports[0], t);
    (determinant_sign(papers_matrix(set)) > 0 ? regular : past) = t;
  }
  PerLandmarkSystem by_paper(set.model.kernels.psi);
  EXPECT_EQ(by_paper.factorize(set.positions, set.supports).kind, FactorStatus::kIllConditioned);
  std::printf("the smallest of them, %zu landmarks: condition %.2g at %.3f of the way\n",
              set.positions.size(), by_paper.condition(), past);
}

// K is a kernel's matrix: every principal part is positive definite too, and its least eigenvalue is not below that of
// the support that is worst conditioned, for Σ_m (w_m α)ᵀ Ψ_m (w_m α) ≥ min λ(Ψ_m) |α|².
TEST(BlendedKernelSystem, LeastEigenvalueIsNotBelowThatOfTheWorstSupport) {
  std::mt19937_64 random(5);
  for (int k = 0; k < 20; ++k) {
    const RandomTissues set = test::random_tissues(random, kKernels[static_cast<std::size_t>(k % 4)], 40);
    const auto n = static_cast<Eigen::Index>(set.positions.size());
    const auto& kernels = set.model.kernels;
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n, n);
    double worst = 1;
    for (std::size_t m = 0; m < kernels.size(); ++m) {
      Eigen::MatrixXd psi(n, n), w(n, 1);
      std::vector<double> shares(kernels.size());
      for (Eigen::Index i = 0; i < n; ++i) {
        const auto& p = set.positions;
        set.model.membership.shares(p[static_cast<std::size_t>(i)], shares);
        w(i) = shares[m];
        for (Eigen::Index j = 0; j < n; ++j)
          psi(i, j) = kernels.value(m, p[static_cast<std::size_t>(i)] - p[static_cast<std::size_t>(j)]);
      }
      K += (w * w.transpose()).cwiseProduct(psi);
      worst = std::min(worst, test::symmetric_eigenvalues(psi)[0]);
    }
    EXPECT_NEAR(K.diagonal().minCoeff(), 1, 1e-12);
    EXPECT_NEAR(K.diagonal().maxCoeff(), 1, 1e-12);
    EXPECT_GT(test::symmetric_eigenvalues(K)[0], worst - 1e-12);
  }
}

// The exact singular triple of core/DESIGN.md, section 2, under the paper's rule, each landmark in a tissue of its own.
TEST(BlendedKernelSystem, SolvesTheTripleOnWhichThePapersRuleIsSingular) {
  const double h = 2, a = 4 * h, b = 11.660167858376596 * h;
  const std::vector<Vec3> p = {{-h, 0, 0}, {0, 0, 0}, {h, 0, 0}}, d = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const TissueModel<ScalarKernels> model{{{{sphere({0, 0, 0}, h), h, 1}}, 2}, {Wendland31{}, {a, b}}};
  const Solved solved(model, p, d);
  ASSERT_TRUE(solved.status);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_LT((solved.field.displacement(p[i]) - d[i]).norm(), 1e-12);
}

TEST(BlendedKernelSystem, ClearOfABlendATissuesFieldIsThatOfItsSupportAlone) {
  const TissueModel<ScalarKernels> model{{{{sphere({0, 0, 0}, 10), 4, 1}}, 2}, {Wendland31{}, {6, 15}}};
  const std::vector<Vec3> p = {{0, 0, 1}, {2, 0, -3}, {40, 0, 0}}, d = {{1, 0, 0}, {0, 1, 0}, {0, 0, 2}};
  const Solved solved(model, p, d);
  ASSERT_TRUE(solved.status);
  RbfSystem inner(Wendland31{}, 15, 2), outer(Wendland31{}, 6, 1);
  const std::vector<Vec3> q(p.begin(), p.begin() + 2);
  std::vector<Vec3> w(2), v(1);
  ASSERT_TRUE(inner.factorize(q));
  ASSERT_TRUE(outer.factorize(std::vector<Vec3>{p[2]}));
  inner.solve(std::vector<Vec3>(d.begin(), d.begin() + 2), w);
  outer.solve(std::vector<Vec3>{d[2]}, v);
  const RbfField inside{Wendland31{}, 15, q, w}, outside{Wendland31{}, 6, std::span(p).subspan(2), v};
  for (const Vec3& X : {Vec3(0, 0, 0), Vec3(3, -4, 1), Vec3(0, 7.9, 0)})
    EXPECT_LT((solved.field.displacement(X) - inside.displacement(X)).norm(), 1e-12);
  EXPECT_LT((solved.field.displacement({43, 1, 0}) - outside.displacement({43, 1, 0})).norm(), 1e-12);
  EXPECT_EQ(solved.field.displacement({0, 12.1, 0}), Vec3(0, 0, 0));  // within reach of 15 mm, but no share
}

TEST(BlendedKernelSystem, OneSupportEverywhereIsTheHomogeneousField) {
  std::mt19937_64 random(8);
  for (const Kernel& psi : kKernels) {
    const RandomTissues set = test::random_tissues(random, psi, 40);
    std::vector<Membership::Part> parts;
    for (int r = 0; r < 3; ++r) parts.push_back({sphere(uniform_point(random, 15), 8), 4, 0});
    const TissueModel<ScalarKernels> model{{parts, 1}, {psi, {14}}};
    const Solved solved(model, set.positions, set.displacements);
    ASSERT_TRUE(solved.status);
    RbfSystem system(psi, 14, 40);
    ASSERT_TRUE(system.factorize(set.positions));
    std::vector<Vec3> weights(set.positions.size());
    system.solve(set.displacements, weights);
    const RbfField field{psi, 14, set.positions, weights};
    for (int k = 0; k < 50; ++k) {
      const Vec3 X = uniform_point(random, 22);
      EXPECT_LT((solved.field.displacement(X) - field.displacement(X)).norm(), 1e-9);
      EXPECT_LT((solved.field.deformation_gradient(X) - field.deformation_gradient(X)).norm(), 1e-9);
    }
  }
}

TissueModel<CompactKernels> compact_model() {
  ElasticBody body;
  CompactKernels kernels;
  for (const double wall : {48.0, 20.0, 9.0}) {
    body.box_size.setConstant(2 * wall);
    body.shear_modulus = 0.1 / wall;
    kernels.kernels.push_back(CompactKernel::of_body(body));
  }
  return {{{{sphere({0, 0, 0}, 14), 5, 1}, {sphere({4, 0, 0}, 5), 3, 2}}, 3}, std::move(kernels)};
}

TEST(BlendedKernelSystem, CompactElasticIsSolvedToo) {
  std::mt19937_64 random(4);
  const auto model = compact_model();
  for (int k = 0; k < 20; ++k) {
    const auto set = test::random_landmarks(random, 30, 18, 2, 3);
    const Solved solved(model, set.positions, set.displacements);
    ASSERT_TRUE(solved.status);
    for (std::size_t i = 0; i < set.positions.size(); ++i)
      EXPECT_LT((solved.field.displacement(set.positions[i]) - set.displacements[i]).norm(), 1e-10);
  }
}

TEST(BlendedKernelSystem, OneCompactKernelEverywhereIsTheMatrixKernelField) {
  std::mt19937_64 random(6);
  const CompactKernel kernel = CompactKernel::of_body({});
  const TissueModel<CompactKernels> model{{{{sphere({0, 0, 0}, 14), 5, 0}}, 1}, {{kernel}}};
  const auto set = test::random_landmarks(random, 20, 18, 3, 3);
  const Solved solved(model, set.positions, set.displacements);
  ASSERT_TRUE(solved.status);
  MatrixKernelSystem system(kernel);
  ASSERT_TRUE(system.factorize(set.positions));
  const std::vector<Vec3> forces = system.solve(set.displacements);
  const std::vector<Vec3> X = {{0, 0, 0}, {13, 0, 1}, {-4, 8, 20}};
  const std::vector<Vec3> u = system.evaluate(X, forces);
  for (std::size_t i = 0; i < X.size(); ++i)
    EXPECT_LT((solved.field.displacement(X[i]) - u[i]).norm(), 1e-10);
}

template <class Kernels>
double gradient_error(const HeterogeneousField<Kernels>& field, std::mt19937_64& random) {
  double worst = 0;
  for (int k = 0; k < 200; ++k) {
    const Vec3 X = uniform_point(random, 22);
    Mat3 F = Mat3::Identity();
    constexpr double kStep = 1e-4;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 h = kStep * Vec3::Unit(axis);
      F.col(axis) += (field.displacement(X + h) - field.displacement(X - h)) / (2 * kStep);
    }
    worst = std::max(worst, (field.deformation_gradient(X) - F).norm());
  }
  return worst;
}

TEST(HeterogeneousField, GradientIsThatOfTheDisplacement) {
  std::mt19937_64 random(7);
  for (const Kernel& psi : {kKernels[1], kKernels[2], kKernels[3]}) {  // psi30 has cusps
    const RandomTissues set = test::random_tissues(random, psi, 30);
    const Solved solved(set.model, set.positions, set.displacements);
    ASSERT_TRUE(solved.status);
    EXPECT_LT(gradient_error(solved.field, random), 1e-5) << name_of(psi);
  }
  const auto model = compact_model();
  const auto set = test::random_landmarks(random, 20, 18, 4, 3);
  const Solved solved(model, set.positions, set.displacements);
  ASSERT_TRUE(solved.status);
  EXPECT_LT(gradient_error(solved.field, random), 1e-5);
}

// Tissues are coupled only where they blend, so that a blend takes the whole difference of their displacements: it
// folds unless it is wider than kMaxSlope displacements (with a support so wide that ψ hardly falls across it).
TEST(HeterogeneousField, ABlendFoldsWhereItIsNarrowerThanItsLaw) {
  const double blend = 5;
  const TissueModel<ScalarKernels> model{{{{sphere({0, 0, 0}, 20), blend, 1}}, 2},
                                         {Wendland31{}, {400, 400.1}}};
  const std::vector<Vec3> p = {{17.4, 0, 0}};
  const auto least_det = [&](double push) {
    const Solved solved(model, p, {Vec3(push, 0, 0)});
    double least = 1;
    for (double x = 17.5; x < 22.5; x += 0.01) least = std::min(least, solved.field.jacobian({x, 0, 0}));
    return least;
  };
  EXPECT_GT(least_det(0.98 * blend / Membership::kMaxSlope), 0);
  EXPECT_LT(least_det(1.02 * blend / Membership::kMaxSlope), 0);
}

template <class Kernels>
void expect_no_allocation(const TissueModel<Kernels>& model, int n) {
  std::mt19937_64 random(9);
  const auto set = test::random_landmarks(random, n, 20, 2, 3);
  const auto most = static_cast<std::size_t>(n);
  BlendedKernelSystem<Kernels> system(model, most);
  std::vector<Vec3> weights(most);
  const std::uint64_t before = test::allocation_count();
  ASSERT_TRUE(system.factorize(set.positions));
  system.solve(set.displacements, weights);
  const HeterogeneousField<Kernels> field{&model, set.positions, system.shares(), weights};
  EXPECT_LT((field.displacement(set.positions[3]) - set.displacements[3]).norm(), 1e-8);
  EXPECT_TRUE(field.deformation_gradient({1, 2, 3}).allFinite());
  EXPECT_EQ(test::allocation_count() - before, 0u);
}

// As many landmarks as a scene may have: 100 of the needle, and for the ψ kernels 64 anchors.
TEST(BlendedKernelSystem, DoesNotAllocateAtAnySize) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "a sanitizer owns malloc";
  const TissueModel<ScalarKernels> model{{{{sphere({0, 0, 0}, 10), 4, 1}}, 2}, {Wendland31{}, {6, 15}}};
  for (const int n : {5, 40, 164}) expect_no_allocation(model, n);
  for (const int n : {5, 40, 100}) expect_no_allocation(compact_model(), n);
}

// The needle of the default scene in a nodule: every 5 mm a shaft landmark drags 1 mm along, the tip 1.5 mm.
TEST(HeterogeneousField, AShaftFoldsANarrowBlendAndNotTheDefaultOne) {
  const auto least_det = [](double blend) {
    const TissueModel<ScalarKernels> model{{{{sphere({0, 0, 4}, 9), blend, 1}}, 2}, {Wendland31{}, {12, 6}}};
    double least = 1;
    for (const double tip : {-10.0, -7.0, -5.0, -3.0, 2.0, 10.0, 12.0, 15.0}) {
      std::vector<Vec3> p, d;
      for (double z = -20; z < tip - 1; z += 5) {
        p.emplace_back(0, 0, z);
        d.emplace_back(0, 0, 1);
      }
      p.emplace_back(0, 0, tip);
      d.emplace_back(0, 0, 1.5);
      const Solved solved(model, p, d);
      for (double z = -23; z < 22; z += 0.1)
        for (double x = 0; x < 6; x += 0.5) least = std::min(least, solved.field.jacobian({x, 0, z}));
    }
    return least;
  };
  EXPECT_LT(least_det(3), 0);
  EXPECT_GT(least_det(RegionSettings::kBlendMm), 0.41);
}

TEST(BlendedKernelSystem, RefusesWhatCannotBeSolvedByNameAndSolvesTheNextSet) {
  const TissueModel<ScalarKernels> model{{{{sphere({0, 0, 0}, 10), 4, 1}}, 2}, {Wendland31{}, {6, 15}}};
  BlendedKernelSystem<ScalarKernels> system(model, 3);
  FactorStatus status = system.factorize(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 0, 1e-5}});
  EXPECT_EQ(status.kind, FactorStatus::kDuplicate);
  EXPECT_EQ(status.first, 0);
  EXPECT_EQ(status.second, 2);
  EXPECT_EQ(system.size(), 0u);
  status = system.factorize(std::vector<Vec3>{{0, 0, 0}, {std::nan(""), 0, 0}});
  EXPECT_EQ(status.kind, FactorStatus::kNotFinite);
  EXPECT_EQ(status.first, 1);
  EXPECT_TRUE(system.factorize(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}}));
  EXPECT_EQ(system.size(), 2u);
}

}  // namespace
}  // namespace brachy
