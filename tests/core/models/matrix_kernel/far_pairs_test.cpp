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
  double number() { return number_(random_); }

 private:
  Vec3 point() { return {number(), number(), number()}; }

  std::minstd_rand random_{7};
  std::uniform_real_distribution<double> number_{-1, 1};
};

void put(const Piece& a, const Piece& b, double s, double weight, std::size_t lane, FarPairs& pairs) {
  pairs.s[lane] = s;
  for (int k = 0; k < 2; ++k)
    for (int q = 0; q < 2; ++q) {
      const Vec3 apart = a.at[static_cast<std::size_t>(k)] - b.at[static_cast<std::size_t>(q)];
      pairs.x[2 * k + q][lane] = apart.x();
      pairs.y[2 * k + q][lane] = apart.y();
      pairs.z[2 * k + q][lane] = apart.z();
      for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j) {
          const double more_a = a.along[k][i] - a.across[k][i], more_b = b.along[q][j] - b.across[q][j];
          pairs.weight[2 * i + j][2 * k + q][lane] = weight * a.across[k][i] * b.across[q][j];
          pairs.along_a[2 * i + j][2 * k + q][lane] = weight * more_a * b.across[q][j];
          pairs.along_b[2 * i + j][2 * k + q][lane] = weight * a.across[k][i] * more_b;
          pairs.along_both[2 * i + j][2 * k + q][lane] = weight * more_a * more_b;
        }
    }
  for (int k = 0; k < 3; ++k) {
    pairs.axis_a[k][lane] = a.axis[k];
    pairs.axis_b[k][lane] = b.axis[k];
  }
}

Mat3 block(const FarBlocks& blocks, int i, int j, std::size_t lane) {
  Mat3 value;
  for (int k = 0; k < 9; ++k) value(k / 3, k % 3) = blocks.value[2 * i + j][k][lane];
  return value;
}

TEST_P(FarPairLoops, OfEvenPiecesAreKelvinsSolutionToTheLastBit) {
  FarPairs pairs{};
  pairs.are_even = true;
  std::vector<Piece> as, bs;
  const double s = 0.31, weight = 0.8;
  for (std::size_t lane = 0; lane < FarPairs::kCount; ++lane) {
    as.push_back(piece(true));
    bs.push_back(piece(true));
    put(as.back(), bs.back(), s, weight, lane, pairs);
  }
  FarBlocks blocks;
  far_pair_loop(GetParam())(pairs, 1 / (4 * (1 - kPoisson)), kScale, blocks);
  for (std::size_t lane = 0; lane < FarPairs::kCount; ++lane)
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        Mat3 sum = Mat3::Zero();
        for (int k = 0; k < 2; ++k)
          for (int q = 0; q < 2; ++q) {
            const Vec3 apart =
                as[lane].at[static_cast<std::size_t>(k)] - bs[lane].at[static_cast<std::size_t>(q)];
            sum += (weight * as[lane].across[k][i] * bs[lane].across[q][j]) *
                   Mat3(kScale * kelvin(apart, s, kPoisson));
          }
        EXPECT_EQ(block(blocks, i, j, lane), sum);
      }
}

TEST_P(FarPairLoops, OfUnevenPiecesAreSharesOnBothSides) {
  FarPairs pairs{};
  std::vector<Piece> as, bs;
  const double s = 0.31, weight = 0.8;
  for (std::size_t lane = 0; lane < FarPairs::kCount; ++lane) {
    as.push_back(piece(lane % 3 == 0));
    bs.push_back(piece(lane % 2 == 0));
    put(as.back(), bs.back(), s, weight, lane, pairs);
  }
  FarBlocks blocks;
  far_pair_loop(GetParam())(pairs, 1 / (4 * (1 - kPoisson)), kScale, blocks);
  for (std::size_t lane = 0; lane < FarPairs::kCount; ++lane)
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        Mat3 sum = Mat3::Zero();
        for (int k = 0; k < 2; ++k)
          for (int q = 0; q < 2; ++q) {
            const Vec3 apart =
                as[lane].at[static_cast<std::size_t>(k)] - bs[lane].at[static_cast<std::size_t>(q)];
            sum += weight * as[lane].share(k, i) * Mat3(kScale * kelvin(apart, s, kPoisson)) *
                   bs[lane].share(q, j);
          }
        EXPECT_NEAR((block(blocks, i, j, lane) - sum).norm(), 0, 1e-14);
      }
}

INSTANTIATE_TEST_SUITE_P(Targets, FarPairLoops,
                         testing::Values(SimdTarget::kGeneric, SimdTarget::kSse4, SimdTarget::kAvx2,
                                         SimdTarget::kAvx512),
                         [](const auto& target) { return std::string(to_string(target.param)); });

}  // namespace
}  // namespace brachy
