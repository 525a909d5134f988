// The fit of the needle's bending to measured insertions.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "apps/lab/deflection/deflection_fit.h"
#include "core/base/error.h"
#include "tests/data_dir.h"

namespace brachy {
namespace {

// A tip that cuts along its tangent on springs of k for each mm leaves an arc of curvature F/(2βEI), β = (k/4EI)^¼:
// the deflection off the path is v = e^{−βξ}(A cos βξ + B sin βξ) behind the tip, v''(0) = −κ, v'''(0) = F/EI and
// v'(0) = 0.
TEST(NeedlePath, IsAnArcOnAnElasticFoundation) {
  for (const double k : {0.05, 0.2, 1.0}) {
    const NeedlePathSettings settings{.needle_length_mm = 400,
                                      .spacing_mm = 1,
                                      .step_mm = 0.25,
                                      .depth_mm = 250,
                                      .foundation_n_per_mm2 = k};
    const std::vector<double> path = needle_path(settings);
    const double beta = std::pow(k / (4 * settings.bending_stiffness_nmm2), 0.25);
    const double closed = 1 / (2 * beta * settings.bending_stiffness_nmm2);
    const std::size_t h = 200, end = path.size() - 1;  // 50 mm
    const double curvature = (path[end] - 2 * path[end - h] + path[end - 2 * h]) / (50 * 50);
    EXPECT_NEAR(curvature, closed, 0.02 * closed) << k;
  }
}

TEST(NeedlePath, IsTheStraighterTheStifferTheNeedle) {
  NeedlePathSettings settings;
  const double soft = needle_path(settings).back();
  settings.bending_stiffness_nmm2 *= 1000;
  EXPECT_LT(needle_path(settings).back(), 0.05 * soft);
  EXPECT_GT(soft, 0);
}

std::vector<MeasuredInsertion> synthetic(const NeedlePathSettings& needle, double force_n, double angle_rad,
                                         double scatter_rad) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  const std::vector<double> path = needle_path(needle);
  std::vector<MeasuredInsertion> insertions;
  for (int number = 1; number <= 5; ++number) {
    MeasuredInsertion insertion{.number = number};
    const double own = scatter_rad * normal(random);
    for (double d = 5; d <= 95; d += 5) {
      insertion.depth_mm.push_back(d);
      const double p = path[static_cast<std::size_t>(std::lround(d / needle.step_mm))];
      insertion.across_mm[0].push_back(force_n * p + (angle_rad + own) * d + 0.02 * normal(random));
      insertion.across_mm[1].push_back(0.02 * normal(random));
    }
    insertions.push_back(insertion);
  }
  return insertions;
}

TEST(DeflectionStudy, FindsWhatSyntheticInsertionsWereMadeWith) {
  NeedlePathSettings needle;
  needle.shear_modulus = 0.006;
  const DeflectionStudy study(synthetic(needle, 0.3, 0.02, 0.002), needle,
                              {.noise_mm = 0.02, .angle_deg = 0.2, .origin_mm = 0.01},
                              {0.002, 0.004, 0.006, 0.009, 0.015});
  const DeflectionFit fit = study.fit({0, 1, 2, 3, 4});
  EXPECT_EQ(study.moduli()[fit.modulus], 0.006);
  EXPECT_NEAR(fit.force_n[0], 0.3, 0.03);
  EXPECT_NEAR(fit.angle_rad[0], 0.02, 0.003);
  EXPECT_NEAR(fit.force_n[1], 0, 0.02);
  const PredictionErrors told = study.predict(50), untold = study.predict(0);
  EXPECT_EQ(told.splits, 10u);
  EXPECT_EQ(told.passed_splits, 10u);
  EXPECT_LT(told.end_max_mm, 0.15);
  EXPECT_GT(untold.end_max_mm, told.end_max_mm);
  EXPECT_GT(study.predict(50, true).end_mean_mm, 2 * told.end_mean_mm);  // a straight line
}

TEST(DeflectionStudy, PredictsTheMeasuredPhantoms) {
  BRACHY_REQUIRE_DATA(data);
  std::vector<double> moduli;
  for (double modulus = 0.001; modulus < 0.21; modulus *= 1.3) moduli.push_back(modulus);
  for (const char* name : {"phantom_a.csv", "phantom_b.csv"}) {
    const DeflectionStudy study(load_insertions(data / "needle_deflection" / name), {}, {}, moduli);
    const PredictionErrors told = study.predict(50);
    EXPECT_EQ(told.passed_splits, 10u) << name;
    EXPECT_LE(told.end_max_mm, 0.5) << name;
    EXPECT_LE(told.rms_max_mm, 0.3) << name;
  }
}

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

std::string refusal_of(const std::string& text) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "deflection.csv";
  write_file(file, text);
  try {
    load_insertions(file);
  } catch (const UserError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(DeflectionStudy, RefusesFilesThatItCannotUse) {
  const std::string header = "insertion,step,depth_mm,x_mm,z_mm\n";
  EXPECT_NE(refusal_of("insertion,step,depth_mm,x_mm\n1,0,0,0\n").find("deflection.csv:1"),
            std::string::npos);
  EXPECT_NE(refusal_of(header + "1,0,0,zero,0\n").find("deflection.csv:2"), std::string::npos);
  EXPECT_NE(refusal_of(header + "1,0,0,0,0\n1,1,5,0,0\n1,2,4,0,0\n").find("deflection.csv:4"),
            std::string::npos);
  EXPECT_NE(refusal_of(header + "1,0,0,0,0\n1,1,5,0,0\n").find("fewer than 4 poses"), std::string::npos);
  std::string one = header;
  for (int i = 0; i < 6; ++i) one += "1," + std::to_string(i) + "," + std::to_string(5 * i) + ",0,0\n";
  EXPECT_NE(refusal_of(one).find("has 1 insertions"), std::string::npos);
  EXPECT_NE(refusal_of(one + "2,0,0,0,0\n1,0,0,0,0\n").find("comes twice"), std::string::npos);
}

}  // namespace
}  // namespace brachy
