#include "core/models/blended/blended_kernel_cells.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>

#include "core/geometry/tissue/phantom.h"
#include "core/injectivity/injectivity_search.h"
#include "tests/core/models/blended/random_tissues.h"
#include "tests/sanitized.h"

namespace brachy {
namespace {

using test::RandomTissues;
using test::uniform;
using test::uniform_point;

const std::array<Kernel, 4> kCellKernels = {Wendland30{}, Wendland31{}, Wendland32{}, Buhmann{}};

TissueModel<CompactKernels> three_box_model() {
  ElasticBody body;
  CompactKernels kernels;
  for (const double wall : {48.0, 20.0, 9.0}) {
    body.box_size.setConstant(2 * wall);
    kernels.kernels.push_back(CompactKernel::of_body(body));
  }
  return {{{{std::make_shared<EllipsoidDistance>(Vec3(0, 0, 0), Vec3(14, 12, 13)), 5, 1},
            {std::make_shared<EllipsoidDistance>(Vec3(4, 0, 0), Vec3::Constant(5)), 3, 2}},
           3},
          std::move(kernels)};
}

// A field with all that it refers to, as the certificate uses it.
template <class Kernels>
struct Looked {
  Looked(const TissueModel<Kernels>& model, const std::vector<Vec3>& positions,
         const std::vector<Vec3>& displacements)
      : system(model, positions.size()),
        weights(positions.size()),
        cells(model, best_simd_target(), positions.size()) {
    EXPECT_TRUE(system.factorize(positions));
    system.solve(displacements, weights);
    field = {&model, positions, system.shares(), weights};
    cells.set_field(field);
  }
  BlendedKernelSystem<Kernels> system;
  std::vector<Vec3> weights;
  HeterogeneousField<Kernels> field{};
  BlendedKernelCells<Kernels> cells;
};

double nuclear_norm(const Mat3& A) {
  return Eigen::JacobiSVD<Mat3>(A).singularValues().sum();
}

Mat3 at_point(const CellGradients& A, std::size_t k) {
  Mat3 a;
  for (Eigen::Index e = 0; e < 9; ++e)
    a(e / 3, e % 3) = static_cast<double>(A.a[static_cast<std::size_t>(e)][k]);
  return a;
}

// In random cells: gradients at a lattice and five other points against the field's, slopes against their bound, and
// the error of interpolation from the lattice against its bound.
template <class Kernels>
void expect_bounds(const Looked<Kernels>& looked, std::mt19937_64& random, int cells) {
  const std::size_t n = looked.field.positions.size();
  std::vector<std::uint32_t> all(n), chosen(n);
  for (std::uint32_t i = 0; i < n; ++i) all[i] = i;
  for (int c = 0; c < cells; ++c) {
    const double half = uniform(random, 0.05, 2);
    const Cell cell{looked.field.positions[random() % n] + uniform_point(random, 6), half};
    CellBounds bounds;
    const std::size_t count = looked.cells.narrow(cell, all, chosen.data(), bounds);
    CellPoints X{};
    std::array<Vec3, 5> inner;  // in lattice steps from the first point
    for (std::size_t k = 0; k < CellPoints::kCount; ++k) {
      Vec3 x(static_cast<double>(k % 3) - 1, static_cast<double>(k / 3 % 3) - 1,
             static_cast<double>(k / 9) - 1);
      if (k >= CellPoints::kLattice) {
        x = uniform_point(random, 1);
        inner[k - CellPoints::kLattice] = x + Vec3::Ones();
      }
      X.x[k] = static_cast<float>(half * x.x());
      X.y[k] = static_cast<float>(half * x.y());
      X.z[k] = static_cast<float>(half * x.z());
    }
    CellGradients A{};
    looked.cells.gradients(cell, {chosen.data(), count}, bounds, X, A);
    for (std::size_t k = 0; k < CellPoints::kCount; k += 3) {
      const Mat3 exact = looked.cells.gradient(cell.centre + Vec3(X.x[k], X.y[k], X.z[k]));
      ASSERT_LE(nuclear_norm(exact), bounds.slope * (1 + 1e-9) + 1e-12);
      if (bounds.cusp < 0) {
        ASSERT_LE((at_point(A, k) - exact).norm(), bounds.rounding + 1e-9);
      }
    }
    for (std::size_t k = 0; k < inner.size(); ++k) {
      Mat3 interpolated = Mat3::Zero();
      const Eigen::Vector3i first = inner[k].cast<int>().cwiseMin(1);
      const Vec3 t = inner[k] - first.cast<double>();
      for (int e = 0; e < 8; ++e) {
        const Eigen::Vector3i step(e & 1, e >> 1 & 1, e >> 2);
        double weight = 1;
        for (int axis = 0; axis < 3; ++axis) weight *= step[axis] ? t[axis] : 1 - t[axis];
        const Eigen::Vector3i corner = first + step;
        interpolated +=
            weight * at_point(A, static_cast<std::size_t>(corner.x() + 3 * corner.y() + 9 * corner.z()));
      }
      ASSERT_LE((at_point(A, CellPoints::kLattice + k) - interpolated).norm(),
                half * half / 8 * bounds.curvature + 2 * bounds.rounding + 1e-6);
    }
  }
}

TEST(BlendedKernelCells, GradientsAreTheFieldsAndBoundsHold) {
  std::mt19937_64 random(12);
  for (const Kernel& psi : kCellKernels)
    for (int k = 0; k < 4; ++k) {
      const RandomTissues set = test::random_tissues(random, psi, 20);
      expect_bounds(Looked(set.model, set.positions, set.displacements), random, 40);
    }
  const auto model = three_box_model();
  const auto set = test::random_landmarks(random, 12, 15, 4, 3);
  expect_bounds(Looked(model, set.positions, set.displacements), random, 60);
}

TEST(BlendedKernelCells, BoundsHoldBesideAMeshToo) {
  std::mt19937_64 random(13);
  const SurfaceBvh surface(prostate_phantom(300));
  const TissueModel<ScalarKernels> model{{{{std::make_shared<SampledDistance>(surface, 10), 10, 1}}, 2},
                                         {Wendland31{}, {12, 20}}};
  std::vector<Vec3> positions, displacements;
  for (std::size_t v = 0; v < 300; v += 30) {
    positions.push_back(0.97 * surface.mesh().vertices[v]);
    displacements.push_back(uniform_point(random, 1));
  }
  expect_bounds(Looked(model, positions, displacements), random, 60);
}

// Verdicts against brute force: no field that folds at a point of a fine grid about the landmarks is certified, and
// most of those that do not fold there are.
TEST(BlendedKernelCells, NothingThatFoldsIsCalledInjective) {
  std::mt19937_64 random(14);
  int injective = 0, folded = 0, unknown = 0;
  for (int k = 0; k < (test::kIsSanitized ? 8 : 80); ++k) {
    RandomTissues set = test::random_tissues(random, kCellKernels[static_cast<std::size_t>(k % 4)], 8);
    const double scale = uniform(random, 0.05, 1);
    for (Vec3& d : set.displacements) d *= scale;
    const Looked looked(set.model, set.positions, set.displacements);
    InjectivitySearch search(looked.cells.sources());
    const auto result = search.run(looked.cells, 1, search.find_fold_candidate(looked.cells), 12000);
    injective += result.verdict == Verdict::kInjective;
    folded += result.verdict == Verdict::kFolded;
    unknown += result.verdict == Verdict::kUnknown;
    if (result.verdict == Verdict::kFolded) {
      EXPECT_LE(looked.field.jacobian(result.place), 0);
    }
    if (result.verdict != Verdict::kInjective) continue;
    for (const Vec3& p : set.positions)
      for (int i = 0; i < 1000; ++i) {
        const Vec3 X = p + 0.6 * Vec3(i % 10 - 4.5, i / 10 % 10 - 4.5, i / 100 - 4.5);
        ASSERT_GE(looked.field.jacobian(X), result.det_bound - 1e-6) << k;
      }
  }
  std::printf("%d injective, %d folded, %d unknown\n", injective, folded, unknown);
  EXPECT_GT(injective, 0);
  EXPECT_GT(folded, 0);
}

}  // namespace
}  // namespace brachy
