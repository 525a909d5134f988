#include "apps/landmarks/refusal.h"

#include <gtest/gtest.h>

#include "core/solve/rbf_system.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

double condition(const Kernel& kernel, double a, const std::vector<Vec3>& p) {
  RbfSystem system(kernel, a, static_cast<int>(p.size()));
  return system.factorize(p) ? system.condition() : INFINITY;
}

FactorStatus status(const Kernel& kernel, double a, const std::vector<Vec3>& p) {
  RbfSystem system(kernel, a, static_cast<int>(p.size()));
  const FactorStatus factored = system.factorize(p);
  return factored ? FactorStatus::of_condition(system.condition()) : factored;
}

// 20 in a row, 0.01 mm apart: a support of 40 mm is 4,000 spacings.
std::vector<Vec3> row() {
  std::vector<Vec3> p;
  for (int i = 0; i < 20; ++i) p.emplace_back(0, 0, 0.01 * i);
  return p;
}

TEST(Refusal, TheLargestStableSupportIsWhereTheConditionNumberCrossesTheBound) {
  std::mt19937_64 random(1);
  std::vector<Vec3> cloud = test::random_landmarks(random, 25, 15, 2, 1).positions;
  cloud.push_back(cloud[4] + Vec3(0, 0, 1e-4));
  for (const std::vector<Vec3>& p : {row(), cloud})
    for_each_kernel([&](auto kernel) {
      const double a = largest_stable_support(kernel, p, 1000);
      EXPECT_LE(condition(kernel, a, p), FactorStatus::kMaxCondition) << kernel.kName;
      if (a < 1000) {
        EXPECT_GT(condition(kernel, 1.02 * a, p), FactorStatus::kMaxCondition) << kernel.kName;
      }
    });
  EXPECT_EQ(largest_stable_support(Wendland30{}, cloud, 12), 12);  // it can be solved as it is
  EXPECT_LT(largest_stable_support(Wendland32{}, row(), 1000), 40);
  EXPECT_EQ(largest_stable_support(Wendland31{}, std::vector<Vec3>(2, Vec3(1, 2, 3)), 12), 0);
}

TEST(Refusal, TheLeastStableSpacingIsWhereThinnedLandmarksCrossTheBound) {
  const std::vector<Vec3> p = row();
  const auto condition_of = [&](std::span<const std::size_t> chosen) {
    std::vector<Vec3> kept;
    for (const std::size_t i : chosen) kept.push_back(p[i]);
    return condition(Wendland32{}, 40, kept);
  };
  const double spacing = least_stable_spacing(p, condition_of);
  EXPECT_GT(spacing, 0.01);
  EXPECT_LT(spacing, 0.4);
  // By hand: every k-th landmark; a spacing just above k − 1 of theirs leaves those.
  for (std::size_t k = 2; k < p.size(); ++k) {
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < p.size(); i += k) chosen.push_back(i);
    if (condition_of(chosen) > FactorStatus::kMaxCondition) continue;
    EXPECT_NEAR(spacing, 0.01 * static_cast<double>(k - 1), 0.011 * 0.01 * static_cast<double>(k - 1));
    break;
  }
}

TEST(Refusal, SaysWhyAndWhatWouldDo) {
  const std::vector<Vec3> p = row(), d(20, Vec3(0, 0.1, 0));
  const FactorStatus why = status(Wendland32{}, 40, p);
  ASSERT_EQ(why.kind, FactorStatus::kNotPositiveDefinite);
  const std::string text = explain_refusal(why, p, d, Wendland32{}, 40);
  for (const char* part :
       {"singular to rounding", "0.01 mm apart", "psi32", "support of 40 mm", "supports up to",
        "from 0.25 mm on the largest displacement alone does not fold", "thinned to"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(text.find('\n'), std::string::npos);
  // The numbers in the message can be solved.
  const auto named = [&](const std::string& after) {
    return std::stod(text.substr(text.find(after) + after.size()));
  };
  EXPECT_LE(condition(Wendland32{}, named("supports up to "), p), FactorStatus::kMaxCondition);

  const std::string pushed = explain_refusal(why, p, std::vector<Vec3>(20, Vec3(0, 20, 0)), Wendland32{}, 40);
  EXPECT_NE(pushed.find("no support works"), std::string::npos) << pushed;
}

TEST(Refusal, SaysTheNumberWhereThereIsOne) {
  const std::vector<Vec3> p{{0, 0, 0}, {0, 0, 0.005}, {0, 0, 0.01}}, d(3, Vec3::Zero());
  const FactorStatus why = status(Wendland32{}, 40, p);
  ASSERT_EQ(why.kind, FactorStatus::kIllConditioned);
  const std::string text = explain_refusal(why, p, d, Wendland32{}, 40);
  EXPECT_NE(text.find("condition number of "), std::string::npos) << text;
  EXPECT_NE(text.find("above 1e+12"), std::string::npos) << text;
  EXPECT_EQ(text.find("does not fold"), std::string::npos) << text;  // nothing is displaced
}

TEST(Refusal, NamesLandmarksWhereTheyAreKnown) {
  const std::vector<Vec3> p(8, Vec3::Zero()), d(8, Vec3::Zero());
  EXPECT_EQ(explain_refusal({FactorStatus::kDuplicate, 2, 7}, p, d, Wendland31{}, 12),
            "landmarks 2 and 7 (from 0) coincide within the solver's resolution");
  EXPECT_EQ(explain_refusal({FactorStatus::kNotFinite, 3}, p, d, Wendland31{}, 12),
            "landmark 3 (from 0) has a coordinate that is not finite");
}

}  // namespace
}  // namespace brachy
