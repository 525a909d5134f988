#include "core/brachytherapy/dose/dose_rate.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "core/brachytherapy/dose/source.h"

namespace brachy {
namespace {

constexpr SourceModel kSeedModels[] = {SourceModel::kAmersham6711, SourceModel::kTheraSeed200};

double radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

Vec3 random_offset(std::mt19937& random, double half) {
  std::uniform_real_distribution<double> one(-half, half);
  const double x = one(random), y = one(random), z = one(random);
  return {x, y, z};
}

// Anywhere within 30 mm, in any direction, of either source.
DoseSeed random_seed(std::mt19937& random) {
  DoseSeed seed{.position = random_offset(random, 30),
                .axis = random_offset(random, 1).normalized(),
                .source = kSeedModels[random() % 2],
                .air_kerma_strength_u = 0.3 + 0.01 * static_cast<double>(random() % 100)};
  return seed;
}

TEST(DoseSource, KnowsItsModelsByNameAndNoOthers) {
  for (const SourceModel model : kSeedModels) {
    EXPECT_EQ(tg43_source(model).model, model);
    EXPECT_EQ(find_source(to_string(model)), model);
  }
  EXPECT_EQ(find_source("6711"), SourceModel::kAmersham6711);
  EXPECT_EQ(find_source("200"), SourceModel::kTheraSeed200);
  for (const char* name : {"", "6702", "67110", "0200", "200 ", "I-125"})
    EXPECT_FALSE(find_source(name)) << name;
}

TEST(GeometryFunction, HasItsKnownValues) {
  EXPECT_NEAR(geometry_function(0.3, 1, 0), 0.9925997, 1e-6);
  EXPECT_NEAR(geometry_function(0.3, 0, 1), 1.0230179, 1e-6);
  EXPECT_NEAR(geometry_function(0.3, 0, 0.5), 4.3956044, 1e-6);
  EXPECT_EQ(geometry_function(0.3, 0, -0.5), geometry_function(0.3, 0, 0.5));
}

TEST(GeometryFunction, IsThatOfAPointFarAway) {
  for (const double theta : {0.0, 30.0, 90.0})
    EXPECT_NEAR(
        100 * 100 * geometry_function(0.3, 100 * std::sin(radians(theta)), 100 * std::cos(radians(theta))), 1,
        1e-5);
}

// ∫ ds/|x − s|² over the line by Simpson's rule, independent of the formula in angles.
TEST(GeometryFunction, IsTheMeanInverseSquareDistanceOfTheLine) {
  for (const double L : {0.3, 0.423})
    for (const double rho : {0.04, 0.2, 1.0, 5.0})
      for (const double z : {0.0, 0.1, 0.225, 1.0, 3.0}) {
        constexpr int kIntervals = 20000;
        double sum = 0;
        for (int i = 0; i <= kIntervals; ++i) {
          const double s = L * (static_cast<double>(i) / kIntervals - 0.5);
          sum += (i == 0 || i == kIntervals ? 1 : i % 2 == 1 ? 4 : 2) / (rho * rho + (z - s) * (z - s));
        }
        const double mean = sum / (3.0 * kIntervals);
        EXPECT_NEAR(geometry_function(L, rho, z) / mean, 1, 1e-9) << L << " " << rho << " " << z;
      }
}

// Near the axis G differs from its limit by O(ρ²), and is exact to rounding.
TEST(GeometryFunction, KeepsItsDigitsNearTheAxis) {
  for (const double L : {0.3, 0.423})
    for (const double z : {0.225, 0.5, 2.0, 10.0})
      for (double rho = 1e-4; rho > 1e-300; rho *= 1e-7) {
        const double q = z * z - L * L / 4;
        const double series = (1 - rho * rho * (1 / q + L * L / (3 * q * q))) / q;
        EXPECT_NEAR(geometry_function(L, rho, z) * q, series * q,
                    1e-13 + 20 * std::pow(rho * rho / q, 2) * (1 + L * L / q))
            << z << " " << rho;
      }
}

TEST(RadialDoseFunction, MeetsItsTableExactly) {
  for (const SourceModel model : kSeedModels) {
    const Tg43Source& source = tg43_source(model);
    for (std::size_t i = 0; i < source.g.size(); ++i)
      EXPECT_EQ(radial_dose_function(source, source.g_r_cm[i]), source.g[i])
          << source.name << " " << source.g_r_cm[i];
  }
}

TEST(RadialDoseFunction, IsLogLinearBetweenNodesNearestBelowAndALineInTheLogarithmAbove) {
  const Tg43Source& source = tg43_source(SourceModel::kAmersham6711);
  EXPECT_NEAR(radial_dose_function(source, 2.5), std::sqrt(0.814 * 0.632), 1e-12);
  EXPECT_NEAR(radial_dose_function(source, 3.25), std::pow(0.632, 0.75) * std::pow(0.496, 0.25), 1e-12);
  EXPECT_EQ(radial_dose_function(source, 0.04), 1.055);
  EXPECT_EQ(radial_dose_function(source, 0), 1.055);
  EXPECT_NEAR(radial_dose_function(source, 12), 0.0803 * std::pow(0.0803 / 0.109, 2), 1e-12);
  const Tg43Source& palladium = tg43_source(SourceModel::kTheraSeed200);
  EXPECT_NEAR(radial_dose_function(palladium, 13), 0.00615 * 0.00615 / 0.0262, 1e-12);
}

TEST(AnisotropyFunction, MeetsItsTableExactly) {
  for (const SourceModel model : kSeedModels) {
    const Tg43Source& source = tg43_source(model);
    const std::size_t columns = source.F_r_cm.size();
    for (std::size_t i = 0; i < source.F.size(); ++i)
      EXPECT_EQ(anisotropy_function(source, source.F_r_cm[i % columns], source.F_theta_deg[i / columns]),
                source.F[i])
          << source.name << " " << source.F_r_cm[i % columns] << " cm " << source.F_theta_deg[i / columns];
  }
}

TEST(AnisotropyFunction, IsBilinearBetweenNodesAndTheNearestBeyondThem) {
  const Tg43Source& source = tg43_source(SourceModel::kAmersham6711);
  EXPECT_NEAR(anisotropy_function(source, 2.5, 15), (0.58 + 0.609 + 0.727 + 0.743) / 4, 1e-12);
  EXPECT_NEAR(anisotropy_function(source, 0.625, 2.5), 0.75 * (0.333 + 0.4) / 2 + 0.25 * (0.37 + 0.429) / 2,
              1e-12);
  EXPECT_EQ(anisotropy_function(source, 0.1, 10), 0.519);
  EXPECT_EQ(anisotropy_function(source, 9, 10), 0.645);
  EXPECT_NEAR(anisotropy_function(source, 9, 5), 0.587, 1e-15);
}

TEST(DoseRate, IsTheDoseRateConstantAtTheReferencePoint) {
  for (const SourceModel model : kSeedModels) {
    const Tg43Source& source = tg43_source(model);
    EXPECT_NEAR(dose_rate_per_u(source, 0, 10), source.dose_rate_constant, 1e-12);
  }
}

TEST(DoseRate, OfTheWholeDecayIsKnownAtTheReferencePoint) {
  const DoseSeed seed{.position = Vec3::Zero(),
                      .axis = Vec3::UnitZ(),
                      .source = SourceModel::kAmersham6711,
                      .air_kerma_strength_u = 1};
  EXPECT_NEAR(100 * total_dose_gy({&seed, 1}, {10, 0, 0}), 1984.7, 0.001 * 1984.7);
  EXPECT_NEAR(100 * total_dose_gy({&seed, 1}, {0, -10, 0}), 1984.7, 0.001 * 1984.7);
}

// By hand from the table: Λ G/G₀ g F at (2 cm, 30°) and on the axis at 3 cm.
TEST(DoseRate, IsTheProductOfTheProtocolsFactors) {
  const Tg43Source& source = tg43_source(SourceModel::kAmersham6711);
  const double g0 = 2 * std::atan(0.15) / 0.3;
  const double rho = 2 * std::sin(radians(30)), z = 2 * std::cos(radians(30));
  const double beta = std::atan((z + 0.15) / rho) - std::atan((z - 0.15) / rho);
  EXPECT_NEAR(dose_rate_per_u(source, 10 * z, 10 * rho), 0.965 * (beta / (0.3 * rho)) / g0 * 0.814 * 0.842,
              1e-9);
  EXPECT_NEAR(dose_rate_per_u(source, 30, 0), 0.965 / (9 - 0.0225) / g0 * 0.632 * 0.488, 1e-9);
}

TEST(DoseRate, IsTheSameOnBothSidesOfTheMiddleBitForBit) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> one(0, 40);
  for (int i = 0; i < 1000; ++i) {
    const double along = one(random), away = one(random);
    for (const SourceModel model : kSeedModels)
      EXPECT_EQ(dose_rate_per_u(tg43_source(model), along, away),
                dose_rate_per_u(tg43_source(model), -along, away));
  }
}

TEST(DoseRate, DoesNotKnowWhichWayTheAxisPoints) {
  std::mt19937 random(2);
  for (int i = 0; i < 1000; ++i) {
    DoseSeed seed = random_seed(random);
    const Vec3 p = random_offset(random, 40);
    const double dose = dose_rate_cgy_h(seed, p);
    seed.axis = -seed.axis;
    EXPECT_EQ(dose_rate_cgy_h(seed, p), dose);
  }
}

TEST(DoseRate, IsTheSameAllAroundTheAxisAndMirrored) {
  std::mt19937 random(3);
  for (int i = 0; i < 1000; ++i) {
    const DoseSeed seed = random_seed(random);
    const Vec3 d = random_offset(random, 40);
    const double dose = dose_rate_cgy_h(seed, seed.position + d);
    const Vec3 turned = Eigen::AngleAxisd(0.01 * i, seed.axis) * d;
    EXPECT_NEAR(dose_rate_cgy_h(seed, seed.position + turned) / dose, 1, 1e-11);
    EXPECT_NEAR(dose_rate_cgy_h(seed, seed.position + d - 2 * d.dot(seed.axis) * seed.axis) / dose, 1, 1e-11);
  }
}

TEST(DoseRate, MovesWithTheSeed) {
  std::mt19937 random(4);
  for (int i = 0; i < 1000; ++i) {
    DoseSeed seed = random_seed(random);
    const Vec3 p = random_offset(random, 40);
    const double dose = dose_rate_cgy_h(seed, p);
    const Mat3 R = Eigen::AngleAxisd(0.1 * i, random_offset(random, 1).normalized()).toRotationMatrix();
    const RigidTransform X{R, random_offset(random, 100)};
    seed.position = X * seed.position;
    seed.axis = X.R * seed.axis;
    EXPECT_NEAR(dose_rate_cgy_h(seed, X * p) / dose, 1, 1e-10);
  }
}

TEST(DoseRate, AddsUpOverSeedsAndIsProportionalToStrength) {
  std::mt19937 random(5);
  std::vector<DoseSeed> seeds(20);
  for (DoseSeed& seed : seeds) seed = random_seed(random);
  for (int i = 0; i < 100; ++i) {
    const Vec3 p = random_offset(random, 40);
    double sum = 0;
    for (const DoseSeed& seed : seeds) {
      const double half_life_h = seed.source == SourceModel::kAmersham6711 ? 59.40 * 24 : 16.991 * 24;
      sum += dose_rate_cgy_h(seed, p) * half_life_h / std::log(2.0) / 100;
    }
    const double dose = total_dose_gy(seeds, p);
    EXPECT_NEAR(dose / sum, 1, 1e-12);
    std::vector<DoseSeed> stronger = seeds;
    for (DoseSeed& seed : stronger) seed.air_kerma_strength_u *= 2;
    EXPECT_EQ(total_dose_gy(stronger, p), 2 * dose);
  }
  EXPECT_EQ(total_dose_gy({}, Vec3::Zero()), 0);
}

TEST(DoseRate, IsFiniteAndPositiveInsideTheCapsuleAndOnItsAxis) {
  for (const SourceModel model : kSeedModels) {
    const Tg43Source& source = tg43_source(model);
    for (double along = -3; along <= 3; along += 0.03125)
      for (double away = 0; away <= 0.5; away += 0.03125) {
        const double rate = dose_rate_per_u(source, along, away);
        EXPECT_TRUE(std::isfinite(rate) && rate > 0) << source.name << " " << along << " " << away;
      }
    EXPECT_TRUE(std::isfinite(dose_rate_per_u(source, 0, 0)));
  }
}

TEST(DoseRate, InsideTheCapsuleIsThatOfThePointOutwardsOnItsSurface) {
  for (const SourceModel model : kSeedModels) {
    const Tg43Source& source = tg43_source(model);
    EXPECT_EQ(dose_rate_per_u(source, 0, 0), dose_rate_per_u(source, 0.4, 0.4));
    EXPECT_NEAR(dose_rate_per_u(source, 1, 0.25), dose_rate_per_u(source, 1.15, 0.4), 1e-9);
    EXPECT_NEAR(dose_rate_per_u(source, -2.125, 0.125), dose_rate_per_u(source, 2.25, 0.25), 1e-9);
  }
}

// Along lines through the capsule and its axis in all directions no step is larger than the slope allows.
TEST(DoseRate, IsContinuousIntoTheCapsuleAndOntoTheAxis) {
  constexpr double kStep = 1e-6;
  const std::array<Vec3, 5> starts = {Vec3(0, 0, 0), Vec3(0.4, 0, 0), Vec3(0, 0, 2.25), Vec3(0.4, 0, 2.25),
                                      Vec3(0, 0, 4)};
  std::mt19937 random(6);
  for (const SourceModel model : kSeedModels)
    for (const Vec3& start : starts)
      for (int i = 0; i < 200; ++i) {
        const DoseSeed seed{
            .position = Vec3::Zero(), .axis = Vec3::UnitZ(), .source = model, .air_kerma_strength_u = 1};
        const double here = dose_rate_cgy_h(seed, start);
        const double there = dose_rate_cgy_h(seed, start + kStep * random_offset(random, 1));
        EXPECT_NEAR(there / here, 1, 30 * kStep) << start.transpose();
      }
}

TEST(DoseRate, IsNotANumberWhereThePointIsNone) {
  const DoseSeed seed{.position = Vec3::Zero(), .axis = Vec3::UnitZ(), .air_kerma_strength_u = 1};
  EXPECT_TRUE(std::isnan(dose_rate_cgy_h(seed, {std::numeric_limits<double>::quiet_NaN(), 0, 0})));
}

}  // namespace
}  // namespace brachy
