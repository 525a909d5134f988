#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/simd/simd_target.h"
#include "core/solve/panel_loops.h"

namespace brachy {

/// The inner loops of InverseBlock, for one instruction set. X is n × m by rows, `stride` numbers to the next row, a
/// multiple of kColumns; what lies beyond column m is zero. Column j of X is zero before row starts[j].
/// Threads: any. Real-time: no allocation.
struct InverseLoops {
  static constexpr std::size_t kColumns = 16;  ///< of X that are computed together
  static constexpr std::size_t padded(std::size_t columns) {
    return (columns + kColumns - 1) / kColumns * kColumns;
  }
  static constexpr std::size_t kRows = 4;  ///< rows of X, and of the Gram matrix, computed together

  /// X = L⁻¹ X, L the lower triangle of an n × n matrix by columns, `outer` numbers to the next one. `starts` ascend.
  void (*solve_lower)(const double* L, std::size_t outer, std::size_t n, const std::uint32_t* starts,
                      double* X, std::size_t stride, std::size_t m);
  /// The same for rows [first, n), `first` a multiple of kRows, by the first n rows of L as panels that begin at column
  /// 0; rows of X before `first` are solved. An element of X has the same bits whatever `first` is.
  void (*solve_panels)(const PanelMatrix& L, std::size_t first, std::size_t n, const std::uint32_t* starts,
                       double* X, std::size_t stride, std::size_t m);
  /// The lower triangle of H += XᵀX over rows [first, end) of X. Summed up in several calls, over one range of rows
  /// after the other, H has the same bits as in one.
  void (*add_gram)(const double* X, std::size_t stride, std::size_t first, std::size_t end,
                   const std::uint32_t* starts, std::size_t m, double* H, std::size_t outer);
  /// Z = AᵀX by rows, of n rows of A (`columns`, which start at `a_starts`) and X; all strides multiples of kColumns,
  /// `starts` of both ascending. Fills whole rows of Z up to the next multiple of kColumns.
  void (*product)(const double* A, std::size_t a_stride, const std::uint32_t* a_starts, std::size_t columns,
                  const double* X, std::size_t stride, const std::uint32_t* starts, std::size_t m,
                  std::size_t n, double* Z, std::size_t z_stride);
  /// sums = Xᵀy of n rows, up to the next multiple of kColumns; `starts` ascend.
  void (*project)(const double* X, std::size_t stride, const std::uint32_t* starts, std::size_t m,
                  const double* y, std::size_t n, double* sums);
  /// y −= X sums, of which those beyond m are zero up to the next multiple of kColumns.
  void (*subtract)(const double* X, std::size_t stride, const std::uint32_t* starts, std::size_t m,
                   const double* sums, std::size_t n, double* y);
  /// The lower triangle of H = XᵀX, m × m by columns, `outer` numbers to the next one. `starts` in any order.
  void (*gram)(const double* X, std::size_t stride, std::size_t n, const std::uint32_t* starts, std::size_t m,
               double* H, std::size_t outer);
};

/// The loops for `target`, which this processor must support.
const InverseLoops& inverse_loops(SimdTarget target);

}  // namespace brachy
