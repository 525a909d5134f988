// The measurements of `brachy zwidth` against theory, and the command end to end.
#include "apps/lab/zwidth/zwidth.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/apps/apps_testing.h"

namespace brachy::test {
namespace {

DeviceDynamicsSettings device() {
  return {};
}

class ZWidth : public testing::TestWithParam<ZWidthCase> {};

TEST_P(ZWidth, IsCalmUnderTheNegotiatedLimitAndRingsFrom1Point3OfItOn) {
  const ZWidthPoint point = measure_zwidth(GetParam(), device());
  EXPECT_EQ(point.greatest_calm_share, 1);
  EXPECT_GT(point.least_ringing_share, 0);
  EXPECT_LE(point.least_ringing_share, 1.3);
  EXPECT_NEAR(point.stable_n_per_mm / point.exact_n_per_mm, 1, 0.02);
}

INSTANTIATE_TEST_SUITE_P(RatesAndDelays, ZWidth, testing::ValuesIn(zwidth_cases(true)),
                         [](const auto& tried) {
                           const ZWidthCase& c = tried.param;
                           return std::string(c.local_model ? "Local" : "Wire") +
                                  std::to_string(static_cast<int>(c.rate_hz)) + "HzDelay" +
                                  std::to_string(static_cast<int>(1e3 * c.added_delay_s)) + "Ms";
                         });

TEST(ZWidthDevice, ALocalModelsLimitDoesNotKnowTheNetworksDelay) {
  const double near =
      measure_zwidth({.local_model = true, .rate_hz = 1000, .added_delay_s = 0}, device()).stable_n_per_mm;
  const double far =
      measure_zwidth({.local_model = true, .rate_hz = 1000, .added_delay_s = 0.05}, device()).stable_n_per_mm;
  EXPECT_EQ(near, far);
  EXPECT_GT(far, 50 * measure_zwidth({.local_model = false, .rate_hz = 1000, .added_delay_s = 0.05}, device())
                          .stable_n_per_mm);
}

// A mass that is light against bθ is stable far above the passive limit, so the chart uses a heavy one.
TEST(ZWidthDevice, ALightMassIsStableAboveThePassiveLimit) {
  DeviceDynamicsSettings light;
  light.mass_kg = 0.004;
  const ZWidthPoint point =
      measure_zwidth({.local_model = false, .rate_hz = 1000, .added_delay_s = 0.05}, light);
  EXPECT_EQ(point.greatest_calm_share, 1);
  EXPECT_GT(point.stable_n_per_mm / point.limit_n_per_mm, 1.3);
  EXPECT_NEAR(point.stable_n_per_mm / point.exact_n_per_mm, 1, 0.02);
}

TEST(ZWidthDevice, WhatTheDaemonBoundsTheLoopsDelayByIsNeverTooShort) {
  for (const ZWidthCase& c : zwidth_cases(false)) {
    if (c.local_model) continue;
    const double period_s = 1 / std::min(c.rate_hz, 1000.0);
    const ZWidthPoint point = measure_zwidth(c, device());
    EXPECT_LE(point.closed.delay_s, wire_delay_s(c.added_delay_s, period_s) + 1e-9)
        << c.rate_hz << " " << c.added_delay_s;
  }
}

TEST(ZWidthTool, WritesATableAndPoints) {
  TempFolder folder;
  const auto json = folder / "z.json", markdown = folder / "z.md";
  const Ended ended =
      run_brachy({"zwidth", "--quick", "--json", json.string(), "--markdown", markdown.string()});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.out.find("Every case is calm under the negotiated limit; every case rings from 1.3"),
            std::string::npos);
  EXPECT_EQ(read_file(markdown), ended.out);
  const auto report = nlohmann::json::parse(read_file(json));
  EXPECT_EQ(report["points"].size(), zwidth_cases(true).size());
  EXPECT_TRUE(refused_in_one_line(run_brachy({"zwidth", "--json", (folder / "no/z.json").string()}), {"no"}));
  EXPECT_TRUE(exited(run_brachy({"zwidth", "--damping", "0"}), 2));
}

}  // namespace
}  // namespace brachy::test
