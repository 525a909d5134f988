#pragma once

#include <vector>

#include <Eigen/Core>

namespace brachy {

/// One support of a compact matrix kernel: w ψ3,1(r/a) I + v Φ(x/a) (compact_kernel.h).
struct CompactTerm {
  double support;  ///< a, mm
  double w, v;     ///< ≥ 0
};

struct CompactFit {
  std::vector<CompactTerm> terms;  ///< by ascending support; times 1/(4πμ) they are mm/N
  double residual;                 ///< ‖fit − aim‖ / ‖aim‖, weighted
};

/// The compact kernel nearest to an elastic solid held at a distance of `wall` (mm): supports of 1/16, 1/8, 1/4,
/// 1/2 and 1 × wall, their weights by non-negative least squares to 4πμ G (kelvin.h, s = core²/2 at both ends,
/// `core` in mm) less its mean over directions at r = wall; at 241 distances 0 … wall, across and along the force,
/// each weighted by √(r + core).
/// Sources: apps/lab/reference/MODEL_STUDY.md, "Compact models". Takes less than 1 ms.
CompactFit fit_compact(double poisson, double core, double wall);

/// argmin ‖A x − b‖ over x ≥ 0, A m × n with independent columns: the active-set algorithm of C. L. Lawson and
/// R. J. Hanson, Solving Least Squares Problems (1974), chapter 23. Deterministic; ends at a Karush–Kuhn–Tucker point.
Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

}  // namespace brachy
