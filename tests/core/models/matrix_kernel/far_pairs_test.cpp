#include "core/models/matrix_kernel/far_pairs.h"

#include <gtest/gtest.h>

#include <random>

#include "core/elasticity/kelvin.h"

namespace brachy {
namespace {

constexpr double kPoisson = 0.49, kScale = 1.37;

struct Piece {
  std::array<Vec3, 2> at;
  Vec3 axis;
  double across[2][2], along[2][2];  // by point, then side

  Mat3 share(int point, int side) const {
    return across[point][side] * Mat3::Identity() +
           (along[point][side] - across[point][side]) * axis * axis.transpose();
  }
};

class FarPairLoops : public testing::TestWithParam<SimdTarget> {
 protected:
  void SetUp() override {
    if (!is_supported(GetParam())) GTEST_SKIP() << "this processor does not have it";
  }

  Piece piece(bool is_even) {
    Piece p;
    for (Vec3& at : p.at) at = 20 * point();
    p.axis = point().normalized();
    for (int k = 0; k < 2; ++k)
      for (int side = 0; side < 2; ++side) {
        p.across[k][side] = number_(random_);
        p.along[k][side] = is_even ? p.across[k][side] : number_(random_);
      }
    return p;
  }

 private:
  double number() { return number_(random_); }
  Vec3 point() { return {number(), number(), number()}; }

  std::minstd_rand random_{7};
  std::uniform_real_distribution<double> number_{-1, 1};
};

constexpr double kCore = 0.31, kWeight = 0.8;  // mm²; the tissue's

void put(const Piece& a, const Piece& b, std::size_t lane, FarPairs& pairs) {
  pairs.s[lane] = kCore;
  for (int k = 0; k < 2; ++k)
    for (int q = 0; q < 2; ++q) {
      const Vec3 apart = a.at[static_cast<std::size_t>(k)] - b.at[static_cast<std::size_t>(q)];
      pairs.x[2 * k + q][lane] = apart.x();
      pairs.y[2 * k + q][lane] = apart.y();
      pairs.z[2 * k + q][lane] = apart.z();
      for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j)
          pairs.even[2 * i + j][2 * k + q][lane] = kWeight * a.across[k][i] * b.across[q][j];
    }
  for (int point = 0; point < 2; ++point)
    for (int side = 0; side < 2; ++side)
      for (int k = 0; k < 9; ++k) {
        pairs.weight[2 * point + side][lane] = kWeight;
        pairs.share_a[point][side][k][lane] = a.share(point, side)(k / 3, k % 3);
        pairs.share_b[point][side][k][lane] = b.share(point, side)(k / 3, k % 3);
      }
}

// What NearMatrix adds for one pair of pieces.
Mat3 expected(const Piece& a, const Piece& b, int i, int j, bool are_even) {
  Mat3 sum = Mat3::Zero();
  for (int k = 0; k < 2; ++k)
    for (int q = 0; q < 2; ++q) {
      const Vec3 apart = a.at[static_cast<std::size_t>(k)] - b.at[static_cast<std::size_t>(q)];
      const Mat3 value = kScale * kelvin(apart, kCore, kPoisson);
      if (are_even)
        sum += (kWeight * a.across[k][i] * b.across[q][j]) * value;
      else
        sum += kWeight * a.share(k, i) * value * b.share(q, j);
    }
  return sum;
}

TEST_P(FarPairLoops, SumKelvinsSolutionWithItsSharesToTheSameBitsAnywhere) {
  for (const bool are_even : {true, false}) {
    FarPairs pairs{};
    pairs.are_even = are_even;
    std::vector<Piece> as, bs;
    for (std::size_t lane = 0; lane < FarPairs::kCount; ++lane) {
      as.push_back(piece(are_even || lane % 3 == 0));
      bs.push_back(piece(are_even));
      put(as.back(), bs.back(), lane, pairs);
    }
    FarBlocks blocks, plain;
    far_pair_loop(GetParam())(pairs, 1 / (4 * (1 - kPoisson)), kScale, blocks);
    far_pair_loop(SimdTarget::kGeneric)(pairs, 1 / (4 * (1 - kPoisson)), kScale, plain);
    for (std::size_t lane = 0; lane < FarPairs::kCount; ++lane)
      for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j) {
          const Mat3 sum = expected(as[lane], bs[lane], i, j, are_even);
          for (int k = 0; k < 9; ++k) {
            EXPECT_EQ(blocks.value[2 * i + j][k][lane], plain.value[2 * i + j][k][lane]);
            EXPECT_NEAR(blocks.value[2 * i + j][k][lane], sum(k / 3, k % 3), 1e-16 + 1e-14 * sum.norm());
          }
        }
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, FarPairLoops,
                         testing::Values(SimdTarget::kGeneric, SimdTarget::kSse4, SimdTarget::kAvx2,
                                         SimdTarget::kAvx512),
                         [](const auto& target) { return std::string(to_string(target.param)); });

}  // namespace
}  // namespace brachy
