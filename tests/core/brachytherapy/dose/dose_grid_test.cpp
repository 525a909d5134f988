#include "core/brachytherapy/dose/dose_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_loops.h"
#include "core/brachytherapy/dose/dose_rate.h"

namespace brachy {
namespace {

constexpr SimdTarget kTargets[] = {SimdTarget::kGeneric, SimdTarget::kSse4, SimdTarget::kAvx2,
                                   SimdTarget::kAvx512};
constexpr SourceModel kModels[] = {SourceModel::kAmersham6711, SourceModel::kTheraSeed200};

Vec3 random_vector(std::mt19937& random, double half) {
  std::uniform_real_distribution<double> one(-half, half);
  const double x = one(random), y = one(random), z = one(random);
  return {x, y, z};
}

DoseSeed random_seed(std::mt19937& random, SourceModel model, double half = 25) {
  return {.position = random_vector(random, half),
          .axis = random_vector(random, 1).normalized(),
          .source = model,
          .air_kerma_strength_u = 0.5};
}

DoseGrid cube(double half, double spacing, SimdTarget target = best_simd_target()) {
  return {Vec3::Constant(-half), Vec3::Constant(half), spacing, target};
}

// The largest |grid/exact − 1| over the grid's points.
double largest_error(const DoseGrid& grid, const std::vector<DoseSeed>& seeds) {
  double largest = 0;
  const auto [nx, ny, nz] = grid.size();
  for (std::size_t k = 0; k < nz; ++k)
    for (std::size_t j = 0; j < ny; ++j)
      for (std::size_t i = 0; i < nx; ++i) {
        const double exact = total_dose_gy(seeds, grid.position(i, j, k));
        const double error = std::abs(static_cast<double>(grid.dose_gy()[grid.index(i, j, k)]) / exact - 1);
        if (!(error <= largest)) largest = error;
      }
  return largest;
}

TEST(DoseGrid, CoversItsBoxAndKnowsWhereItsPointsAre) {
  const DoseGrid grid({-30, -20, 5}, {30, 20.5, 5}, 1);
  EXPECT_EQ(grid.size(), (std::array<std::size_t, 3>{61, 42, 1}));
  EXPECT_EQ(grid.dose_gy().size(), 61u * 42);
  EXPECT_EQ(grid.position(2, 3, 0), Vec3(-28, -17, 5));
  EXPECT_EQ(grid.index(2, 3, 0), 3u * 61 + 2);
  // Thirds do not sum to a whole in binary; this must not add a point.
  EXPECT_EQ(cube(1, 1.0 / 3).size(), (std::array<std::size_t, 3>{7, 7, 7}));
}

TEST(DoseGrid, RefusesMorePointsThanItHoldsAndSaysWhatWouldDo) {
  for (const double half : {1e3, 1e7, 1e300}) try {
      cube(half, 0.25);
      ADD_FAILURE() << half;
    } catch (const UserError& e) {
      EXPECT_NE(std::string(e.what()).find("larger spacing"), std::string::npos) << e.what();
    }
}

TEST(DoseGrid, IsTheExactSumEverywhereOnEveryInstructionSet) {
  for (const SimdTarget target : kTargets) {
    if (!is_supported(target)) continue;
    for (const SourceModel model : kModels) {
      std::mt19937 random(11);
      const DoseSeed seed = random_seed(random, model);
      DoseGrid grid = cube(30, 2, target);
      grid.add(seed);
      EXPECT_LT(largest_error(grid, {seed}), 5e-4) << to_string(target) << " " << to_string(model);
    }
  }
}

// A tenth of a millimetre apart: the axis of a seed, its ends, its inside and the nearest nodes of the table.
TEST(DoseGrid, IsTheExactSumCloseToASeedAndInsideIt) {
  for (const SourceModel model : kModels)
    for (const Vec3& axis : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(1, 2, 3)}) {
      const DoseSeed seed{
          .position = Vec3::Zero(), .axis = axis.normalized(), .source = model, .air_kerma_strength_u = 0.5};
      DoseGrid grid = cube(4, 0.1);
      grid.add(seed);
      EXPECT_LT(largest_error(grid, {seed}), 5e-4) << to_string(model) << " " << axis.transpose();
    }
}

TEST(DoseGrid, IsTheExactSumFarAway) {
  for (const SourceModel model : kModels) {
    const DoseSeed seed{.position = Vec3::Constant(-100),
                        .axis = Vec3(1, -2, 0.5).normalized(),
                        .source = model,
                        .air_kerma_strength_u = 0.5};
    DoseGrid grid({-100, -100, -100}, {40, 40, 40}, 5);
    grid.add(seed);
    EXPECT_LT(largest_error(grid, {seed}), 5e-4) << to_string(model);
  }
}

TEST(DoseGrid, AddsSeedUponSeedOfEitherSource) {
  std::mt19937 random(12);
  std::vector<DoseSeed> seeds;
  DoseGrid grid = cube(30, 3);
  for (int i = 0; i < 100; ++i) {
    seeds.push_back(random_seed(random, kModels[i % 2]));
    grid.add(seeds.back());
  }
  EXPECT_LT(largest_error(grid, seeds), 5e-4);
}

TEST(DoseGrid, IsZeroBeforeTheFirstSeedAndAfterClear) {
  std::mt19937 random(13);
  DoseGrid grid = cube(10, 2);
  const std::vector<float> nothing(grid.dose_gy().size(), 0.0f);
  EXPECT_EQ(grid.dose_gy(), nothing);
  const DoseSeed seed = random_seed(random, SourceModel::kAmersham6711);
  grid.add(seed);
  const std::vector<float> once = grid.dose_gy();
  EXPECT_NE(once, nothing);
  grid.clear();
  EXPECT_EQ(grid.dose_gy(), nothing);
  grid.add(seed);
  EXPECT_EQ(grid.dose_gy(), once);
}

// Scattered points have the dose that a row has there.
TEST(DoseGrid, ScatteredPointsHaveTheDoseOfARow) {
  const DoseSeed seed{Vec3(1, 2, 3), Vec3(0.6, 0, 0.8), SourceModel::kMicroSelectronV2, 1};
  constexpr std::size_t kCount = 37;
  std::vector<float> x, y, z;
  DoseGrid grid(Vec3(-5, 4, 1), Vec3(-5, 4, 1) + Vec3(kCount - 1, 0, 0), 1);
  grid.add(seed);
  for (std::size_t i = 0; i < kCount + DoseScatter::kLanes; ++i) {
    x.push_back(-5 + static_cast<float>(i));
    y.push_back(4);
    z.push_back(1);
  }
  for (const SimdTarget target : kTargets) {
    if (!is_supported(target)) continue;
    std::vector<float> dose(kCount + 1, 0.0f);
    dose_loops(target).add_points(dose_tables(seed.source),
                                  {x.data(), y.data(), z.data(), {1, 2, 3}, {0.6f, 0, 0.8f}}, 1, kCount,
                                  dose.data());
    for (std::size_t i = 0; i < kCount; ++i)
      EXPECT_NEAR(dose[i] / grid.dose_gy()[grid.index(i, 0, 0)], 1, 2e-5) << i << " " << to_string(target);
    EXPECT_EQ(dose[kCount], 0) << "nothing is written beyond the last";
  }
}

// Rows of every length near the loop's block sizes: nothing is written beyond a row's end.
TEST(DoseGrid, WritesItsRowAndNothingElse) {
  for (const SimdTarget target : kTargets) {
    if (!is_supported(target)) continue;
    const DoseRow row{.along = -3, .along_step = 0.1f, .away = {2, 1, 0}, .away_step = {0, 0, 0.2f}};
    std::vector<float> all(200, 0.0f);
    dose_loops(target).add_row(dose_tables(SourceModel::kAmersham6711), row, 1, 200, all.data());
    for (std::size_t count = 0; count < 140; ++count) {
      std::vector<float> some(200, -1.0f);
      std::fill_n(some.begin(), count, 0.0f);
      dose_loops(target).add_row(dose_tables(SourceModel::kAmersham6711), row, 1, count, some.data());
      for (std::size_t i = 0; i < some.size(); ++i)
        ASSERT_EQ(some[i], i < count ? all[i] : -1.0f) << count << " " << i << " " << to_string(target);
    }
  }
}

TEST(DoseGrid, IsLikeADistanceBetweenItsPointsAndNothingOutside) {
  std::mt19937 random(14);
  DoseGrid grid({-10, -9, -8}, {10, 9, 8}, 1);
  grid.add(random_seed(random, SourceModel::kAmersham6711, 5));
  const auto dose = [&](std::size_t i, std::size_t j, std::size_t k) {
    return static_cast<double>(grid.dose_gy()[grid.index(i, j, k)]);
  };
  EXPECT_NEAR(grid.at({-10, -9, -8}) / (dose(0, 0, 0)), 1, 1e-6);
  EXPECT_NEAR(grid.at({10, 9, 8}) / (dose(20, 18, 16)), 1, 1e-6);
  EXPECT_NEAR(grid.at({-7, 0, 3}) / (dose(3, 9, 11)), 1, 1e-6);
  const double r = 0.75 / std::sqrt(dose(3, 9, 11)) + 0.25 / std::sqrt(dose(4, 9, 11));
  EXPECT_NEAR(grid.at({-6.75, 0, 3}) / (1 / (r * r)), 1, 1e-6);
  double mean = 0;
  for (std::size_t corner = 0; corner < 8; ++corner)
    mean += 0.125 / std::sqrt(dose(3 + (corner & 1), 9 + (corner >> 1 & 1), 11 + (corner >> 2)));
  EXPECT_NEAR(grid.at({-6.5, 0.5, 3.5}) / (1 / (mean * mean)), 1, 1e-6);
  EXPECT_NEAR(grid.at({10.49, 0, 0}) / (grid.at({10, 0, 0})), 1, 1e-6);
  for (const Vec3& p : {Vec3(10.51, 0, 0), Vec3(0, -9.51, 0), Vec3(0, 0, 1e9), Vec3(std::nan(""), 0, 0)})
    EXPECT_TRUE(std::isnan(grid.at(p))) << p.transpose();
}

TEST(DoseGrid, IsCloseToTheExactSumBetweenItsPoints) {
  std::mt19937 random(15);
  const DoseSeed seed = random_seed(random, SourceModel::kAmersham6711, 2);
  DoseGrid grid = cube(20, 1);
  grid.add(seed);
  double sum = 0;
  int count = 0;
  while (count < 1000) {
    const Vec3 p = random_vector(random, 20);
    if ((p - seed.position).norm() < 5) continue;
    const double error = std::abs(grid.at(p) / total_dose_gy({&seed, 1}, p) - 1);
    EXPECT_LT(error, 0.05) << (p - seed.position).transpose();  // the anisotropy's kinks about the axis
    sum += error;
    ++count;
  }
  EXPECT_LT(sum / count, 0.005);
}

// What a mistake costs is the dose without its seeds: rounding leaves a little more or less than nothing of them.
TEST(DoseGrid, SeedsThatAreTakenOutAgainLeaveNoDoseAndNoNan) {
  std::mt19937 random(9);
  DoseGrid grid(Vec3::Constant(-12), Vec3::Constant(12), 1);
  std::vector<DoseSeed> seeds;
  for (int n = 0; n < 7; ++n)
    seeds.push_back(
        {random_vector(random, 10), random_vector(random, 1).normalized(), SourceModel::kAmersham6711, 0.5});
  for (const DoseSeed& seed : seeds) grid.add(seed);
  for (DoseSeed seed : seeds) {
    seed.air_kerma_strength_u = -seed.air_kerma_strength_u;
    grid.add(seed);
  }
  EXPECT_LT(std::ranges::min(grid.dose_gy()), 0) << "else this shows nothing";
  for (int n = 0; n < 20'000; ++n) {
    const double gy = grid.at(random_vector(random, 12));
    ASSERT_TRUE(std::isfinite(gy));
    EXPECT_LT(gy, 0.01);
  }
}

}  // namespace
}  // namespace brachy
