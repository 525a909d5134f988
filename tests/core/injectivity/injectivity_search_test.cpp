#include "core/injectivity/injectivity_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "core/injectivity/kernel_bounds.h"
#include "core/injectivity/scalar_cells.h"
#include "core/solve/rbf_system.h"
#include "tests/core/injectivity/grid_search.h"
#include "tests/core/injectivity/random_scene.h"
#include "tests/core/models/blocks/small_tissue.h"
#include "tests/sanitized.h"
#include "tests/scene_count.h"

namespace brachy {
namespace {

constexpr std::size_t kLandmarks = 40;
constexpr std::uint64_t kWork = 8000;  // a tick's

InjectivitySearch::Result search(const RbfField& field, SimdTarget target = best_simd_target(),
                                 std::uint64_t work = kWork) {
  ScalarCells cells(field.kernel, field.support_radius, target, kLandmarks);
  cells.set_field(field);
  InjectivitySearch search(kLandmarks);
  return search.run(cells, 1, search.find_fold_candidate(cells), work);
}

// core/DESIGN.md, section 4: one landmark's field is injective iff a > M|d|.
TEST(InjectivitySearch, OneLandmarkFoldsBetween99And101PercentOfItsBound) {
  for_each_kernel([&](auto kernel) {
    SCOPED_TRACE(kernel.kName);
    test::RandomScenes random(1);
    for (int i = 0; i < 20; ++i) {
      const double a = random.between(2, 40);
      const std::vector<Vec3> p{random.between(0, 60) * random.direction()};
      const Vec3 way = a / kernel.kMaxSlope * random.direction();
      const std::vector<Vec3> under{0.99 * way}, over{1.01 * way};
      EXPECT_EQ(search({kernel, a, p, under}).verdict, Verdict::kInjective);
      EXPECT_EQ(search({kernel, a, p, over}).verdict, Verdict::kFolded);
    }
  });
}

// What a search finds depends on the sum of its work alone.
TEST(InjectivitySearch, MayStopAnywhereAndGoOn) {
  for_each_kernel([&](auto kernel) {
    SCOPED_TRACE(kernel.kName);
    test::RandomScenes random(4);
    int pauses = 0;
    for (int i = 0; i < 40; ++i) {
      const test::RandomScene scene = random.next(8, 20);
      std::vector<Vec3> weights;
      for (const Vec3& d : scene.displacements) weights.push_back(0.3 * d);
      const RbfField field{kernel, scene.support, scene.positions, weights};
      ScalarCells cells(field.kernel, field.support_radius, best_simd_target(), kLandmarks);
      cells.set_field(field);
      InjectivitySearch whole(kLandmarks), parts(kLandmarks);
      const InjectivitySearch::Result& expected = whole.run(cells, 1, {}, kWork);
      parts.begin(cells, 1, {}, kWork / WorkBudget::kRefiningPart);
      do {
        parts.go_on(std::min<std::uint64_t>(97, expected.work - parts.result().work));
        ++pauses;
      } while (parts.is_open() && parts.result().work < expected.work);
      EXPECT_EQ(parts.result().verdict, expected.verdict);
      EXPECT_EQ(parts.result().det_bound, expected.det_bound);
      EXPECT_EQ(parts.result().least_det, expected.least_det);
      EXPECT_EQ(parts.result().work, expected.work);
    }
    EXPECT_GT(pauses, 100);
  });
}

TEST(InjectivitySearch, TargetsAgreeOnVerdicts) {
  const std::vector<Vec3> p{{0, 0, 0}, {1, 2, 4}}, w{{2, 1, 0}, {0, 3, 1}};
  for_each_kernel([&](auto kernel) {
    for (const SimdTarget target : test::supported_targets()) {
      const InjectivitySearch::Result result = search({kernel, 12, p, w}, target);
      EXPECT_EQ(result.verdict, Verdict::kInjective);
      EXPECT_NEAR(result.det_bound, search({kernel, 12, p, w}).det_bound, 1e-3);
    }
  });
}

TEST(KernelBounds, BoundTheKernelsDerivatives) {
  for_each_kernel([&](auto kernel) {
    SCOPED_TRACE(kernel.kName);
    const KernelBounds bounds{Kernel(kernel)};
    test::RandomScenes random(2);
    for (int i = 0; i < 2000; ++i) {
      const double r = random.between(0.02, 0.999), h = 1e-4;
      EXPECT_LE(std::abs(kernel.derivative(r)), bounds.slope(r));
      // D³ψ(|x|)[v, v, v] by differences of the gradient along v.
      const Vec3 x = r * random.direction(), v = random.direction();
      const auto slope = [&](double t) {
        const Vec3 y = x + t * v;
        return kernel.derivative_over_r(y.norm()) * y.dot(v);
      };
      if (r > 0.99) continue;  // differences reach over the edge of the support
      EXPECT_LE(std::abs(slope(h) - 2 * slope(0) + slope(-h)) / (h * h),
                bounds.third(r - h) * (1 + 1e-3) + 1e-5);
    }
    EXPECT_EQ(bounds.has_cusp(), kernel.kName == "psi30");
  });
}

// Between the points of a lattice ∇u is trilinear up to what narrow says, at a support's edge and beside a source too.
TEST(ScalarCells, GradientsBetweenLatticePointsAreWithinTheBound) {
  for_each_kernel([&](auto kernel) {
    SCOPED_TRACE(kernel.kName);
    test::RandomScenes random(4);
    const double a = 12;
    const std::vector<Vec3> p{Vec3::Zero()}, w{{3, -4, 0}};
    const RbfField field{kernel, a, p, w};
    ScalarCells cells(kernel, a, best_simd_target(), kLandmarks);
    cells.set_field(field);
    for (int i = 0; i < 4000; ++i) {
      const double half = random.between(0.1, 2);
      const double distance = i % 2 ? a + random.between(-2, 2) * half : random.between(0, a);
      const Cell cell{distance * random.direction(), half};
      const std::uint32_t from[] = {0};
      std::uint32_t to[1];
      CellBounds bounds;
      if (cells.narrow(cell, from, to, bounds) == 0 || bounds.cusp >= 0) continue;
      Mat3 mean = Mat3::Zero();
      for (int corner = 0; corner < 8; ++corner)
        mean += cells.gradient(cell.centre + half * Vec3(corner & 1, corner >> 1 & 1, corner >> 2)) / 8;
      const double error = (mean - cells.gradient(cell.centre + Vec3::Constant(0.5 * half))).norm();
      EXPECT_LE(error, half * half / 8 * bounds.curvature + bounds.rounding) << distance << " " << half;
    }
  });
}

struct Tally {
  int injective = 0, folded = 0, unknown = 0, wrong = 0;
};

// The verdicts of `count` random scenes against det(I + ∇u) on a grid of 0.25 mm.
template <class K>
Tally against_brute_force(K kernel, std::uint64_t seed, int count) {
  Tally tally;
  test::RandomScenes scenes(seed);
  for (int i = 0; i < count; ++i) {
    const test::RandomScene scene = scenes.next(4, 12);
    RbfSystem system(kernel, scene.support, kLandmarks);
    if (!system.factorize(scene.positions)) continue;
    std::vector<Vec3> weights(scene.positions.size());
    system.solve(scene.displacements, weights);
    const RbfField field{kernel, scene.support, scene.positions, weights};
    const InjectivitySearch::Result result = search(field);
    tally.injective += result.verdict == Verdict::kInjective;
    tally.folded += result.verdict == Verdict::kFolded;
    if (result.verdict == Verdict::kFolded && field.jacobian(result.place) > 0) ++tally.wrong;
    if (result.verdict == Verdict::kFolded) continue;

    ScalarCells cells(kernel, scene.support, best_simd_target(), kLandmarks);
    cells.set_field(field);
    const bool is_folded_on_grid = test::least_on_grid(field, cells) <= 0;
    if (result.verdict == Verdict::kInjective && is_folded_on_grid) ++tally.wrong;
    if (result.verdict == Verdict::kUnknown && !is_folded_on_grid) ++tally.unknown;
  }
  return tally;
}

TEST(InjectivitySearch, IsNeverWronglyInjectiveAndSeldomUnknown) {
  for_each_kernel([&](auto kernel) {
    SCOPED_TRACE(kernel.kName);
    const int count = test::scene_count(test::kIsSanitized ? 12 : 160) / 4;
    const Tally tally = against_brute_force(kernel, 11, count);
    EXPECT_EQ(tally.wrong, 0);
    EXPECT_GT(tally.injective, 0);
    if (count >= 40) {
      EXPECT_LE(tally.unknown, 0.2 * (tally.unknown + tally.injective));
    }
    if (count > 40)
      std::cout << kernel.kName << ": " << tally.injective << " injective, " << tally.folded << " folded, "
                << tally.unknown << " injective but unknown, " << tally.wrong << " wrong\n";
  });
}

}  // namespace
}  // namespace brachy
