#pragma once

#include <vector>

#include "core/injectivity/cell_field.h"
#include "core/injectivity/kernel_bounds.h"
#include "core/solve/rbf_field.h"

namespace brachy {

/// The field of a ψ kernel, for the certificate. Its domain is everything within its supports.
class ScalarCells : public CellField {
 public:
  ScalarCells(const Kernel& kernel, double support_radius, SimdTarget target, std::size_t max_landmarks);

  /// Sets the field, of the kernel and radius above.
  void set_field(const RbfField& field) noexcept;

  std::size_t sources() const override { return field_.positions.size(); }
  Cell domain() const override { return domain_; }
  double resolution() const override { return 0.25 * field_.support_radius; }
  std::size_t narrow(const Cell& cell, std::span<const std::uint32_t> from, std::uint32_t* to,
                     CellBounds& bounds) const noexcept override;
  void gradients(const Cell& cell, std::span<const std::uint32_t> sources, const CellBounds& bounds,
                 const CellPoints& X, CellGradients& A) const noexcept override;
  const CellLoops& loops() const override { return loops_; }
  bool fold_candidates(std::uint32_t i, Cell& cell, CellPoints& X) const noexcept override;
  Mat3 gradient(const Vec3& X) const noexcept override {
    return field_.deformation_gradient(X) - Mat3::Identity();
  }

 private:
  RbfField field_;
  const CellLoops& loops_;
  ScalarGradients gradients_;
  KernelBounds kernel_bounds_;
  double steepest_;  // mm from a source, where its slope is greatest
  Cell domain_;
  std::vector<double> sizes_;  // |weight| of each
  std::vector<float> x_, y_, z_;
  mutable std::vector<float> distances_;
  mutable std::vector<CellSource> chosen_;  // of the current cell
};

}  // namespace brachy
