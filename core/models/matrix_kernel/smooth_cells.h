#pragma once

#include "core/injectivity/cell_field.h"
#include "core/models/matrix_kernel/smooth_field.h"

namespace brachy {

/// What boundary and regions add, for the certificate: one source, bounded cell by cell from the table's nodes and
/// never evaluated point by point.
class SmoothCells : public CellField {
 public:
  /// Tissue and field must outlive this.
  SmoothCells(const Tissue& tissue, const SmoothField& smooth, SimdTarget target);

  std::size_t sources() const override { return 1; }
  Cell domain() const override { return domain_; }
  double resolution() const override { return 0; }
  std::size_t narrow(const Cell& cell, std::span<const std::uint32_t> from, std::uint32_t* to,
                     CellBounds& bounds) const noexcept override;
  void gradients(const Cell& cell, std::span<const std::uint32_t> sources, const CellBounds& bounds,
                 const CellPoints& X, CellGradients& A) const noexcept override;
  const CellLoops& loops() const override { return loops_; }
  bool fold_candidates(std::uint32_t /*i*/, Cell& /*cell*/, CellPoints& /*X*/) const noexcept override {
    return false;
  }
  Mat3 gradient(const Vec3& X) const noexcept override { return smooth_.gradient_at(X); }

 private:
  const SmoothField& smooth_;
  const CellLoops& loops_;
  Vec3 min_, max_;  // of the tissue
  Cell domain_;
};

}  // namespace brachy
