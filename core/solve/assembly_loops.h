#pragma once

#include "core/kernels/kernels.h"
#include "core/solve/panel_loops.h"

namespace brachy {

/// Positions of the landmarks as planes, mm, in the factor's order; the rows that pad the last panel lie beyond every
/// support.
struct PanelPositions {
  const double *x, *y, *z;
};

/// The inner loops that fill K, for one kernel and one instruction set. Without fused multiply-adds: an element has the
/// same bits on every target and however the loop is split.
/// Threads: any. Real-time: no allocation.
struct AssemblyLoops {
  /// K of panel I, columns from first_column[I] to n; returns the least |p_i − p_j|² met with i ≠ j.
  double (*assemble)(const PanelMatrix& matrix, const PanelPositions& p, double support_radius, int I, int n);
  /// values[j] = ψ(|p_j − (x, y, z)| / a) for rows [begin, end), begin a multiple of kColumnStep.
  void (*assemble_row)(const PanelPositions& p, double x, double y, double z, double support_radius,
                       int begin, int end, double* values);
  /// No row of [begin, result) is nearer than `radius` to the point (x, y, z); the result is at most end, and at most
  /// kColumnStep − 1 rows before the first that is nearer.
  int (*first_within)(const PanelPositions& p, double x, double y, double z, double radius, int begin,
                      int end);
};

/// The loops for `kernel` on `target`, which this processor must support.
const AssemblyLoops& assembly_loops(const Kernel& kernel, SimdTarget target);

}  // namespace brachy
