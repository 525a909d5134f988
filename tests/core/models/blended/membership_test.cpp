#include "core/models/blended/membership.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/core/models/blended/random_tissues.h"

namespace brachy {
namespace {

using test::sphere;
using test::uniform_point;

std::vector<double> shares(const Membership& membership, const Vec3& X) {
  std::vector<double> w(membership.tissues());
  membership.shares(X, w);
  return w;
}

TEST(Membership, SquaresAddUpToOneAndNoneIsNegative) {
  std::mt19937_64 random(1);
  for (int k = 0; k < 200; ++k) {
    const auto set = test::random_tissues(random, Wendland31{}, 50);
    for (const Vec3& X : set.positions) {
      double sum = 0;
      for (const double w : shares(set.model.membership, X)) {
        EXPECT_GE(w, 0);
        sum += w * w;
      }
      EXPECT_NEAR(sum, 1, 1e-15);
    }
  }
}

TEST(Membership, IsExactlyNoneOrAllOutsideTheBlend) {
  const Membership membership({{sphere({0, 0, 0}, 10), 4, 1}}, 2);
  EXPECT_EQ(shares(membership, {0, 0, 7.9}), (std::vector<double>{0, 1}));
  EXPECT_EQ(shares(membership, {0, 0, 0}), (std::vector<double>{0, 1}));
  EXPECT_EQ(shares(membership, {0, 0, 12.1}), (std::vector<double>{1, 0}));
  const std::vector<double> between = shares(membership, {0, 10, 0});
  EXPECT_NEAR(between[0], std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(between[1], std::sqrt(0.5), 1e-15);
}

TEST(Membership, ALaterRegionLiesOverAnEarlierOne) {
  const Membership membership({{sphere({0, 0, 0}, 20), 2, 1}, {sphere({5, 0, 0}, 6), 2, 2}}, 3);
  EXPECT_EQ(shares(membership, {5, 0, 0}), (std::vector<double>{0, 0, 1}));
  EXPECT_EQ(shares(membership, {-10, 0, 0}), (std::vector<double>{0, 1, 0}));
  EXPECT_EQ(shares(membership, {40, 0, 0}), (std::vector<double>{1, 0, 0}));
  // On the inner one's surface the outer tissue has half of it, what surrounds both has none.
  const std::vector<double> seam = shares(membership, {11, 0, 0});
  EXPECT_EQ(seam[0], 0);
  EXPECT_NEAR(seam[1], seam[2], 1e-15);
}

TEST(Membership, RegionsOfOneTissueHaveNoSeam) {
  const Membership membership({{sphere({-5, 0, 0}, 8), 3, 1}, {sphere({5, 0, 0}, 8), 3, 1}}, 2);
  for (double x = -9; x <= 9; x += 0.5) EXPECT_NEAR(shares(membership, {x, 0, 0})[1], 1, 1e-15) << x;
  const Membership all({{sphere({0, 0, 0}, 8), 3, 0}}, 1);
  EXPECT_NEAR(shares(all, {8.3, 0, 0})[0], 1, 1e-15);
}

TEST(Membership, GradientsAreThoseOfTheShares) {
  std::mt19937_64 random(2);
  double steepest = 0;
  for (int k = 0; k < 100; ++k) {
    const auto set = test::random_tissues(random, Wendland31{}, 20);
    const Membership& membership = set.model.membership;
    const std::size_t M = membership.tissues();
    std::vector<double> w(M);
    std::vector<Vec3> slopes(M);
    for (const Vec3& X : set.positions) {
      membership.shares(X, w, slopes);
      EXPECT_EQ(w, shares(membership, X));
      for (int axis = 0; axis < 3; ++axis) {
        constexpr double kStep = 1e-5;
        const auto above = shares(membership, X + kStep * Vec3::Unit(axis)),
                   below = shares(membership, X - kStep * Vec3::Unit(axis));
        for (std::size_t m = 0; m < M; ++m)
          EXPECT_NEAR(slopes[m][axis], (above[m] - below[m]) / (2 * kStep), 1e-6);
      }
      for (const Vec3& slope : slopes) steepest = std::max(steepest, slope.norm());
    }
  }
  EXPECT_GT(steepest, 0.5);  // blends were met
}

TEST(Membership, TheSteepestSlopeOfABlendIsKnown) {
  const double blend = 4;
  const Membership membership({{sphere({0, 0, 0}, 10), blend, 1}}, 2);
  std::vector<double> w(2);
  std::vector<Vec3> slopes(2);
  double inner = 0, outer = 0;
  for (double x = 8; x < 12; x += 1e-4) {
    membership.shares({x, 0, 0}, w, slopes);
    inner = std::max(inner, slopes[1].norm());
    outer = std::max(outer, slopes[0].norm());
  }
  EXPECT_NEAR(inner, Membership::kMaxSlope / blend, 1e-8);
  EXPECT_NEAR(outer, Membership::kMaxSlope / blend, 1e-8);
}

}  // namespace
}  // namespace brachy
