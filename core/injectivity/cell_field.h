#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/base/rigid_transform.h"
#include "core/injectivity/cell_loops.h"

namespace brachy {

/// A cube, mm.
struct Cell {
  Vec3 centre;
  double half = 0;  ///< of its side

  /// The least one about a box.
  static Cell around(const Vec3& min, const Vec3& max) {
    return {0.5 * (min + max), 0.5 * (max - min).maxCoeff()};
  }

  double squared_distance(const Vec3& p) const {
    return ((p - centre).cwiseAbs().array() - half).max(0.0).matrix().squaredNorm();
  }
};

/// Bounds of a field over a cell, before any point is evaluated.
struct CellBounds {
  double slope = 0;    ///< |∇u|₁ is at most this (nuclear norm)
  double squeeze = 0;  ///< no eigenvalue of ∇u's symmetric part is below −squeeze
  double shrink = std::numeric_limits<double>::infinity();  ///< div u is not below −shrink
  double curvature = 0;  ///< Σ_k |∂²∇u/∂x_k²|₁ is at most this, 1/mm², but for the source with a cusp
  double rounding = 0;         ///< error of gradients' single precision and of what is not smooth
  std::size_t work = 0;        ///< of gradients, in sources
  std::size_t extra_work = 0;  ///< additional work of narrow itself
  /// a source whose gradient has no limit in or beside the cell; left out of gradients
  std::int32_t cusp = -1;
  Vec3 cusp_weight = Vec3::Zero();
  double cusp_slope = 0;  ///< its ∇u is cusp_weight gᵀ with |g| at most this, 1/mm
};

/// A displacement field as the certificate uses it: cell by cell, from the sources that reach the cell.
/// Threads: one. Real-time: no allocation after construction.
class CellField {
 public:
  virtual ~CellField() = default;

  virtual std::size_t sources() const = 0;
  /// Outside this cube nothing is displaced, or the field is not checked.
  virtual Cell domain() const = 0;
  /// Whether every source counts in every cell, so that a search's work grows with them wherever it looks.
  virtual bool reaches_everywhere() const { return false; }
  /// Cells larger than this (half a side, mm) are not evaluated point by point.
  virtual double resolution() const = 0;

  /// Of the sources `from` those that reach `cell`, into `to`, and bounds of their field there. None: u is constant
  /// there, or not checked.
  virtual std::size_t narrow(const Cell& cell, std::span<const std::uint32_t> from, std::uint32_t* to,
                             CellBounds& bounds) const noexcept = 0;
  /// Adds what narrow left out of a cell's bounds, curvature and work: only cells that are evaluated point
  /// by point need them.
  virtual void bound_curvature(const Cell& /*cell*/, CellBounds& /*bounds*/) const noexcept {}
  /// ∇u by those sources at points about the cell's centre.
  virtual void gradients(const Cell& cell, std::span<const std::uint32_t> sources, const CellBounds& bounds,
                         const CellPoints& X, CellGradients& A) const noexcept = 0;
  virtual const CellLoops& loops() const = 0;

  /// Where a field by source `i` would fold first: kCount points about a cell's centre. False: nowhere.
  virtual bool fold_candidates(std::uint32_t i, Cell& cell, CellPoints& X) const noexcept = 0;

  /// Whether the field is checked at X.
  virtual bool covers(const Vec3& /*X*/) const noexcept { return true; }

  /// ∇u at X in double.
  virtual Mat3 gradient(const Vec3& X) const noexcept = 0;
};

}  // namespace brachy
