#include "core/elasticity/landmark_stiffness.h"

#include <gtest/gtest.h>

#include "core/elasticity/kelvin.h"

namespace brachy {
namespace {

TEST(LandmarkStiffness, IsWhatKelvinsSolutionHasAtItsOwnCore) {
  for (const double poisson : {0.0, 0.3, 0.49})
    for (const double core : {0.635, 5.0}) {
      const double mu = 6e-3, compliance = kelvin(Vec3::Zero(), core * core, poisson)(1, 1) / mu;
      EXPECT_NEAR(elastic_landmark_stiffness(mu, poisson, core) * compliance, 1, 1e-12);
    }
  EXPECT_NEAR(elastic_landmark_stiffness(17e-3 / 3, 0.4999, 0.635), 0.045,
              0.001);  // core/DESIGN.md, section 5
}

}  // namespace
}  // namespace brachy
