#include "core/kernels/kernels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/core/kernels/kernel_formulas.h"

namespace brachy {
namespace {

using namespace test;

// max|ψ′| over the support, from the formula: the steepest of 10⁵ samples, then by ternary search beside it.
Real steepest_slope(const KernelFormula& formula) {
  const auto slope = [&](Real r) { return std::abs(reference_slope(formula, r)); };
  constexpr Real kSpacing = 1e-5L;
  Real steepest = 0;
  for (int i = 0; i < 100'000; ++i)
    if (slope(i * kSpacing) > slope(steepest)) steepest = i * kSpacing;
  Real low = std::max(steepest - kSpacing, Real(0)), high = steepest + kSpacing;
  for (int i = 0; i < 60; ++i) {
    const Real third = (high - low) / 3;
    if (slope(low + third) < slope(high - third))
      low += third;
    else
      high -= third;
  }
  return slope(low);
}

TEST(Kernels, ValuesAndDerivativesMatchTheirFormulas) {
  for_each_kernel([](auto kernel) {
    const KernelFormula& formula = formula_of(kernel.kName);
    for (int i = 0; i <= 4000; ++i) {
      const double r = i / 3200.0;
      EXPECT_NEAR(kernel.value(r), static_cast<double>(reference_psi(formula, r)), 1e-14)
          << kernel.kName << r;
      EXPECT_NEAR(kernel.derivative(r), static_cast<double>(reference_slope(formula, r)), 1e-12)
          << kernel.kName << r;
    }
  });
}

TEST(Kernels, DerivativeOverRadiusTimesRadiusIsTheDerivative) {
  for_each_kernel([](auto kernel) {
    for (int i = 1; i < 1000; ++i) {
      const double r = i / 1000.0;
      EXPECT_NEAR(r * kernel.derivative_over_r(r), kernel.derivative(r), 1e-13);
    }
    EXPECT_TRUE(std::isfinite(kernel.derivative_over_r(0.0)));
  });
}

TEST(Kernels, AreOneAtTheCentreAndExactlyZeroFromTheSupportOn) {
  for_each_kernel([](auto kernel) {
    EXPECT_EQ(kernel.value(0.0), 1.0);
    EXPECT_EQ(kernel.value(0.0f), 1.0f);
    for (double r : {1.0, std::nextafter(1.0, 2.0), 1.5, 1e300}) {
      EXPECT_EQ(kernel.value(r), 0.0);
      EXPECT_EQ(kernel.derivative(r), 0.0);
    }
  });
}

TEST(Kernels, SteepestSlopeIsM) {
  for_each_kernel([](auto kernel) {
    const double steepest = static_cast<double>(steepest_slope(formula_of(kernel.kName)));
    EXPECT_NEAR(kernel.kMaxSlope, steepest, 1e-11) << kernel.kName;
    for (int i = 0; i <= 1'000'000; ++i)
      ASSERT_LE(-kernel.derivative(i * 1e-6), kernel.kMaxSlope + 1e-11) << kernel.kName << i;
  });
}

TEST(Kernels, BuhmannStaysPositiveInSinglePrecisionUpToTheSupport) {
  for (float r = 0.5f; r < 1.0f; r = std::nextafter(r, 2.0f) + 1e-6f) ASSERT_GT(Buhmann::value(r), 0.0f) << r;
}

TEST(Kernels, SinglePrecisionKeepsItsDigits) {
  for_each_kernel([](auto kernel) {
    const KernelFormula& formula = formula_of(kernel.kName);
    for (int i = 0; i <= 100'000; ++i) {
      const float r = static_cast<float>(i) * 1e-5f;
      ASSERT_NEAR(kernel.value(r), static_cast<double>(reference_psi(formula, r)),
                  formula.roundings * 0x1p-25)
          << kernel.kName << r;
    }
  });
}

TEST(Kernels, InsideIsTheValueUpToAndIncludingTheEdge) {
  for_each_kernel([](auto kernel) {
    EXPECT_EQ(kernel.inside(1.0), 0.0) << kernel.kName;
    EXPECT_EQ(kernel.inside(1.0f), 0.0f) << kernel.kName;
    EXPECT_EQ(kernel.inside(0.0), 1.0) << kernel.kName;
    EXPECT_EQ(kernel.inside(0.25), kernel.value(0.25)) << kernel.kName;
  });
}

TEST(Kernels, TheVectorLogarithmIsTheLogarithm) {
  EXPECT_EQ(vector_log(1.0), 0.0);
  EXPECT_EQ(vector_log(1.0f), 0.0f);
  EXPECT_TRUE(std::isfinite(vector_log(0.0)) && std::isfinite(vector_log(0.0f)));
  for (double x = 1e-300; x < 1e300; x *= 1.37)
    ASSERT_NEAR(vector_log(x), std::log(x), 5e-16 * (1 + std::abs(std::log(x))));
  for (float x = 1e-30f; x < 1e30f; x *= 1.0137f)
    ASSERT_NEAR(vector_log(x), std::log(x), 1.5e-7f * (1 + std::abs(std::log(x))));
}

TEST(Kernels, AreFoundByName) {
  std::set<std::string_view> names;
  std::string listed;
  for_each_kernel([&](auto kernel) {
    EXPECT_TRUE(names.insert(kernel.kName).second) << kernel.kName;
    listed += (listed.empty() ? "" : ", ") + std::string(kernel.kName);
    const auto found = find_kernel(kernel.kName);
    ASSERT_TRUE(found) << kernel.kName;
    EXPECT_TRUE(std::holds_alternative<decltype(kernel)>(*found)) << kernel.kName;
    EXPECT_EQ(name_of(*found), kernel.kName);
    EXPECT_EQ(max_slope(*found), kernel.kMaxSlope) << kernel.kName;
  });
  EXPECT_EQ(kernel_names(), listed);
  EXPECT_TRUE(listed.starts_with("psi31, psi30, psi32, buhmann")) << listed;
  EXPECT_FALSE(find_kernel("psi99"));
}

}  // namespace
}  // namespace brachy
