#include "core/kernels/kernels.h"

#include <gtest/gtest.h>

#include <cmath>

namespace brachy {
namespace {

// ψ and ψ′ as DESIGN §2 prints them, in long double and written out anew.
long double reference_value(std::string_view name, long double r) {
  if (r >= 1) return 0;
  if (name == "psi30") return std::pow(1 - r, 2.0L);
  if (name == "psi31") return std::pow(1 - r, 4.0L) * (4 * r + 1);
  if (name == "psi32") return std::pow(1 - r, 6.0L) * (35.0L / 3 * r * r + 6 * r + 1);
  const long double log_term = r > 0 ? 12 * std::pow(r, 4.0L) * std::log(r) : 0;
  return log_term - 21 * std::pow(r, 4.0L) + 32 * std::pow(r, 3.0L) - 12 * r * r + 1;
}

long double reference_derivative(std::string_view name, long double r) {
  if (r >= 1) return 0;
  if (name == "psi30") return -2 * (1 - r);
  if (name == "psi31") return -20 * r * std::pow(1 - r, 3.0L);
  if (name == "psi32") return -56.0L / 3 * r * (1 + 5 * r) * std::pow(1 - r, 5.0L);
  const long double log_term = r > 0 ? 48 * std::pow(r, 3.0L) * std::log(r) : 0;
  return log_term - 72 * std::pow(r, 3.0L) + 96 * r * r - 24 * r;
}

TEST(Kernels, ValuesAndDerivativesMatchTheirFormulas) {
  for_each_kernel([](auto kernel) {
    for (int i = 0; i <= 4000; ++i) {
      const double r = i / 3200.0;
      EXPECT_NEAR(kernel.value(r), static_cast<double>(reference_value(kernel.kName, r)), 1e-14)
          << kernel.kName << r;
      EXPECT_NEAR(kernel.derivative(r), static_cast<double>(reference_derivative(kernel.kName, r)), 1e-12)
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
  const double expected[] = {2.109375, 2.0, 2.4997889, 2.1759974};  // DESIGN §2, in Kernel's order
  int index = 0;
  for_each_kernel([&](auto kernel) {
    double steepest = 0;
    for (int i = 0; i <= 1'000'000; ++i) steepest = std::max(steepest, -kernel.derivative(i * 1e-6));
    EXPECT_NEAR(steepest, kernel.kMaxSlope, 1e-11) << kernel.kName;
    EXPECT_NEAR(kernel.kMaxSlope, expected[index++], 5e-8) << kernel.kName;
  });
}

TEST(Kernels, BuhmannStaysPositiveInSinglePrecisionUpToTheSupport) {
  for (float r = 0.5f; r < 1.0f; r = std::nextafter(r, 2.0f) + 1e-6f) ASSERT_GT(Buhmann::value(r), 0.0f) << r;
}

TEST(Kernels, SinglePrecisionKeepsItsDigits) {
  for_each_kernel([](auto kernel) {
    for (int i = 0; i <= 100'000; ++i) {
      const float r = static_cast<float>(i) * 1e-5f;
      // Half an ulp, 2⁻²⁵, for each rounding; ψ3,2 has most: t six times over, 3 squarings, its factor 5, the product.
      ASSERT_NEAR(kernel.value(r), static_cast<double>(reference_value(kernel.kName, r)), 15 * 0x1p-25)
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
  EXPECT_EQ(name_of(*find_kernel("psi32")), "psi32");
  EXPECT_EQ(max_slope(*find_kernel("psi30")), 2.0);
  EXPECT_FALSE(find_kernel("psi33"));
  EXPECT_EQ(kernel_names(), "psi31, psi30, psi32, buhmann");
}

}  // namespace
}  // namespace brachy
