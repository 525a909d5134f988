#include "core/models/matrix_kernel/far_pairs.h"

#include <cmath>
#include <numbers>

#include "core/base/simd/simd_attributes.h"

namespace brachy {
namespace {

constexpr std::size_t kPairs = FarPairs::kCount;

using Matrices = double[9][kPairs];

BRACHY_INLINE void multiply(const Matrices& __restrict a, const Matrices& __restrict b,
                            Matrices& __restrict product) {
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < kPairs; ++i)
        product[3 * r + c][i] =
            a[3 * r][i] * b[c][i] + a[3 * r + 1][i] * b[3 + c][i] + a[3 * r + 2][i] * b[6 + c][i];
}

BRACHY_INLINE void sum_even(const FarPairs& __restrict pairs, const FarBlocks& __restrict points,
                            FarBlocks& __restrict blocks) {
  for (std::size_t sides = 0; sides < 4; ++sides)
    for (std::size_t k = 0; k < 9; ++k)
      for (std::size_t i = 0; i < kPairs; ++i)
        blocks.value[sides][k][i] = pairs.even[sides][0][i] * points.value[0][k][i] +
                                    pairs.even[sides][1][i] * points.value[1][k][i] +
                                    pairs.even[sides][2][i] * points.value[2][k][i] +
                                    pairs.even[sides][3][i] * points.value[3][k][i];
}

BRACHY_INLINE void sum_uneven(const FarPairs& __restrict pairs, const FarBlocks& __restrict points,
                              FarBlocks& __restrict blocks) {
  for (std::size_t sides = 0; sides < 4; ++sides)
    for (std::size_t at = 0; at < 4; ++at) {
      Matrices weighted, left, both;
      for (std::size_t k = 0; k < 9; ++k)
        for (std::size_t i = 0; i < kPairs; ++i)
          weighted[k][i] = pairs.weight[sides][i] * pairs.share_a[at / 2][sides / 2][k][i];
      multiply(weighted, points.value[at], left);
      multiply(left, pairs.share_b[at % 2][sides % 2], both);
      for (std::size_t k = 0; k < 9; ++k)
        for (std::size_t i = 0; i < kPairs; ++i)
          blocks.value[sides][k][i] = at == 0 ? both[k][i] : blocks.value[sides][k][i] + both[k][i];
    }
}

BRACHY_INLINE void sum_far_pairs(const FarPairs& __restrict pairs, double b, double scale,
                                 FarBlocks& __restrict blocks) {
  constexpr double kShare = 1 / (4 * std::numbers::pi);
  FarBlocks points;  // of point pairs in place of sides
  for (std::size_t at = 0; at < 4; ++at)
    for (std::size_t i = 0; i < kPairs; ++i) {
      const double x = pairs.x[at][i], y = pairs.y[at][i], z = pairs.z[at][i], s = pairs.s[i];
      const double r2 = x * x + y * y + z * z + s, i1 = 1 / std::sqrt(r2), i3 = i1 / r2;
      const double along = kShare * b * i3, across = kShare * ((1 - b) * i1 + 0.5 * s * i3);
      points.value[at][0][i] = scale * (along * x * x + across);
      points.value[at][1][i] = scale * (along * x * y);
      points.value[at][2][i] = scale * (along * x * z);
      points.value[at][3][i] = scale * (along * y * x);
      points.value[at][4][i] = scale * (along * y * y + across);
      points.value[at][5][i] = scale * (along * y * z);
      points.value[at][6][i] = scale * (along * z * x);
      points.value[at][7][i] = scale * (along * z * y);
      points.value[at][8][i] = scale * (along * z * z + across);
    }
  if (pairs.are_even)
    sum_even(pairs, points, blocks);
  else
    sum_uneven(pairs, points, blocks);
}

// NOLINTBEGIN(bugprone-macro-parentheses): an attribute cannot stand in parentheses.
#define BRACHY_FAR_PAIRS(name, Target)                                                 \
  Target void name(const FarPairs& pairs, double b, double scale, FarBlocks& blocks) { \
    sum_far_pairs(pairs, b, scale, blocks);                                            \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_FAR_PAIRS(far_pairs_generic, )
BRACHY_FAR_PAIRS(far_pairs_sse4, BRACHY_SSE4)
BRACHY_FAR_PAIRS(far_pairs_avx2, BRACHY_AVX2)
BRACHY_FAR_PAIRS(far_pairs_avx512, BRACHY_AVX512)

}  // namespace

FarPairLoop far_pair_loop(SimdTarget target) {
  return loops_for<FarPairLoop>(target, far_pairs_generic, far_pairs_sse4, far_pairs_avx2, far_pairs_avx512);
}

}  // namespace brachy
