#include "core/brachytherapy/plan/request/source_limits.h"

#include <gtest/gtest.h>

namespace brachy {
namespace {

TEST(SourceLimits, EachNuclideHasItsOwn) {
  const auto iodine = source_limits(SourceModel::kAmersham6711),
             palladium = source_limits(SourceModel::kTheraSeed200);
  ASSERT_TRUE(iodine && palladium);
  EXPECT_EQ(iodine->nuclide, "I-125");
  EXPECT_EQ(palladium->nuclide, "Pd-103");
  EXPECT_EQ(iodine->most_u, 0.76);
  EXPECT_GT(palladium->least_u, iodine->most_u);
  for (const auto& limits : {*iodine, *palladium}) {
    EXPECT_GE(limits.customary_u, limits.least_u);
    EXPECT_LE(limits.customary_u, limits.most_u);
  }
}

TEST(CustomaryStrength, IsTheNomogramOfIodineAndInProportionToThePrescription) {
  EXPECT_NEAR(customary_strength_u(SourceModel::kAmersham6711, 145, 4), 2.15 * 16, 1e-9);
  EXPECT_NEAR(customary_strength_u(SourceModel::kAmersham6711, 72.5, 4), 0.5 * 2.15 * 16, 1e-9);
}

TEST(CustomaryStrength, PalladiumNeedsMoreAndTheMoreTheLargerTheGland) {
  const double small = customary_strength_u(SourceModel::kTheraSeed200, 125, 3) / (2.15 * 9);
  const double large = customary_strength_u(SourceModel::kTheraSeed200, 125, 5) / (2.15 * 25);
  EXPECT_GT(small, 3);
  EXPECT_GT(large, small * 1.05);  // 21 keV photons are absorbed sooner
  EXPECT_LT(large, 7);
}

}  // namespace
}  // namespace brachy
