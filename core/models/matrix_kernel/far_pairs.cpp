#include "core/models/matrix_kernel/far_pairs.h"

#include <cmath>
#include <numbers>

#include "core/base/simd/simd_attributes.h"

namespace brachy {
namespace {

constexpr std::size_t kPairs = FarPairs::kCount;

// A G B = αβ G + α′β a (aᵀG) + αβ′ (G b) bᵀ + α′β′ (aᵀG b) a bᵀ, of which the first is there already.
BRACHY_INLINE void add_along(const FarPairs& __restrict pairs, const FarBlocks& __restrict points,
                             FarBlocks& __restrict blocks) {
  double of_a[4][3][kPairs], of_b[4][3][kPairs], of_both[4][kPairs];
  for (std::size_t at = 0; at < 4; ++at)
    for (std::size_t i = 0; i < kPairs; ++i) {
      const auto& G = points.value[at];
      const double ax = pairs.axis_a[0][i], ay = pairs.axis_a[1][i], az = pairs.axis_a[2][i];
      const double bx = pairs.axis_b[0][i], by = pairs.axis_b[1][i], bz = pairs.axis_b[2][i];
      for (std::size_t k = 0; k < 3; ++k) {
        of_a[at][k][i] = ax * G[k][i] + ay * G[3 + k][i] + az * G[6 + k][i];
        of_b[at][k][i] = G[3 * k][i] * bx + G[3 * k + 1][i] * by + G[3 * k + 2][i] * bz;
      }
      of_both[at][i] = of_a[at][0][i] * bx + of_a[at][1][i] * by + of_a[at][2][i] * bz;
    }
  for (std::size_t sides = 0; sides < 4; ++sides) {
    double row[3][kPairs] = {}, column[3][kPairs] = {}, both[kPairs] = {};
    for (std::size_t at = 0; at < 4; ++at)
      for (std::size_t i = 0; i < kPairs; ++i) {
        both[i] += pairs.along_both[sides][at][i] * of_both[at][i];
        for (std::size_t k = 0; k < 3; ++k) {
          row[k][i] += pairs.along_a[sides][at][i] * of_a[at][k][i];
          column[k][i] += pairs.along_b[sides][at][i] * of_b[at][k][i];
        }
      }
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < kPairs; ++i)
          blocks.value[sides][3 * r + c][i] +=
              pairs.axis_a[r][i] * (row[c][i] + both[i] * pairs.axis_b[c][i]) +
              column[r][i] * pairs.axis_b[c][i];
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
  for (std::size_t sides = 0; sides < 4; ++sides)
    for (std::size_t k = 0; k < 9; ++k)
      for (std::size_t i = 0; i < kPairs; ++i)
        blocks.value[sides][k][i] = pairs.weight[sides][0][i] * points.value[0][k][i] +
                                    pairs.weight[sides][1][i] * points.value[1][k][i] +
                                    pairs.weight[sides][2][i] * points.value[2][k][i] +
                                    pairs.weight[sides][3][i] * points.value[3][k][i];
  if (!pairs.are_even) add_along(pairs, points, blocks);
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
