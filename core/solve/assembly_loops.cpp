#include "core/solve/assembly_loops.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/simd/simd_attributes.h"

namespace brachy {
namespace {

constexpr int kPanelRows = PanelMatrix::kRows;

BRACHY_INLINE int first_within(const PanelPositions& p, double x, double y, double z, double radius,
                               int begin, int end) {
  constexpr int kStep = PanelMatrix::kColumnStep;
  for (; begin + kStep <= end; begin += kStep) {
    std::int64_t hits = 0;  // as wide as a double: the loop vectorises
    for (int i = 0; i < kStep; ++i) {
      const double dx = p.x[begin + i] - x, dy = p.y[begin + i] - y, dz = p.z[begin + i] - z;
      hits += dx * dx + dy * dy + dz * dz < radius * radius ? 1 : 0;
    }
    if (hits > 0) break;
  }
  return begin;
}

// ψ of eight rows of a panel against one landmark; `self`: which of the eight that landmark is, if any.
constexpr int kHalf = kPanelRows / 2;
template <class K>
BRACHY_INLINE void assemble_rows(const double* px, const double* py, const double* pz, double x, double y,
                                 double z, double inverse_radius, int self, double* __restrict row,
                                 double* __restrict least) {
  for (int i = 0; i < kHalf; ++i) {
    const double dx = px[i] - x, dy = py[i] - y, dz = pz[i] - z;
    const double squared = dx * dx + dy * dy + dz * dz;
    const double other = i == self ? least[i] : squared;
    least[i] = other < least[i] ? other : least[i];
    const double r = std::sqrt(squared) * inverse_radius;
    row[i] = K::inside(r < 1 ? r : 1.0);
  }
}

template <class K>
BRACHY_INLINE void assemble_row(const PanelPositions& p, double x, double y, double z, double support_radius,
                                int begin, int end, double* values) {
  double least[kHalf] = {};
  for (int j = begin; j < end; j += kHalf)
    assemble_rows<K>(p.x + j, p.y + j, p.z + j, x, y, z, 1 / support_radius, -1, values + j, least);
}

template <class K>
BRACHY_INLINE double assemble(const PanelMatrix& matrix, const PanelPositions& p, double support_radius,
                              int I, int n) {
  double least[kHalf];
  for (double& l : least) l = support_radius * support_radius;
  for (int first = I * kPanelRows; first < (I + 1) * kPanelRows; first += kHalf) {
    PanelColumn* panel = matrix.panel(I);
    const int row = first - I * kPanelRows,
              last = std::min(n, first + kHalf);  // columns right of these rows' are not read
    if (first >= n) {
      for (int j = matrix.first_column[I]; j < n; ++j) std::fill_n(panel[j].row + row, kHalf, 0.0);
      break;
    }
    for (int j = matrix.first_column[I]; j < last; ++j)
      assemble_rows<K>(p.x + first, p.y + first, p.z + first, p.x[j], p.y[j], p.z[j], 1 / support_radius,
                       j - first, panel[j].row + row, least);
  }
  return *std::min_element(least, least + kHalf);
}

// One copy of the loops for a target.
// NOLINTBEGIN(bugprone-macro-parentheses): an attribute or a template cannot stand in parentheses.
#define BRACHY_TARGET(name, attribute)                                                                   \
  template <class K>                                                                                     \
  struct name {                                                                                          \
    attribute static double fill(const PanelMatrix& m, const PanelPositions& p, double radius, int I,    \
                                 int n) {                                                                \
      return assemble<K>(m, p, radius, I, n);                                                            \
    }                                                                                                    \
    attribute static void fill_row(const PanelPositions& p, double x, double y, double z, double radius, \
                                   int begin, int end, double* values) {                                 \
      assemble_row<K>(p, x, y, z, radius, begin, end, values);                                           \
    }                                                                                                    \
    attribute static int search(const PanelPositions& p, double x, double y, double z, double radius,    \
                                int begin, int end) {                                                    \
      return first_within(p, x, y, z, radius, begin, end);                                               \
    }                                                                                                    \
    static constexpr AssemblyLoops kLoops{fill, fill_row, search};                                       \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_TARGET(Generic, );
BRACHY_TARGET(Sse4, BRACHY_SSE4);
BRACHY_TARGET(Avx2, BRACHY_AVX2);
BRACHY_TARGET(Avx512, BRACHY_AVX512);

}  // namespace

const AssemblyLoops& assembly_loops(const Kernel& kernel, SimdTarget target) {
  return std::visit(
      [&]<class K>(K) -> const AssemblyLoops& {
        return loops_for(target, Generic<K>::kLoops, Sse4<K>::kLoops, Avx2<K>::kLoops, Avx512<K>::kLoops);
      },
      kernel);
}

}  // namespace brachy
