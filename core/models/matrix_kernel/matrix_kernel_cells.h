#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/elasticity/needle_rings.h"
#include "core/injectivity/cell_field.h"
#include "core/models/matrix_kernel/near_bounds.h"
#include "core/models/matrix_kernel/near_field.h"
#include "core/models/matrix_kernel/smooth_field.h"

namespace brachy {

/// The field of a matrix model, for the certificate: its sources are rings, its domain is the tissue's box,
/// without what lies within kClearance radii of a shaft's axis: there the rings are the needle itself. Tests
/// compare its gradient with
/// the field's differences.
class MatrixKernelCells : public CellField {
 public:
  static constexpr double kClearance = 3;  ///< radii

  /// All must outlive this. `smooth`: none for the compact models.
  MatrixKernelCells(const Tissue& tissue, const NearField& near, const SmoothField* smooth,
                    double needle_radius, SimdTarget target, std::size_t max_rings);

  /// Sets the field: that of `ring_forces` (N, one for each ring), and as far as they are far of their `pieces`.
  void set_field(const NeedleRings& rings, std::span<const Vec3> ring_forces,
                 std::span<const NearField::Piece> pieces) noexcept;

  std::size_t sources() const override { return ring_forces_.size(); }
  Cell domain() const override { return domain_; }
  double resolution() const override { return kResolution; }
  std::size_t narrow(const Cell& cell, std::span<const std::uint32_t> from, std::uint32_t* to,
                     CellBounds& bounds) const noexcept override;
  void gradients(const Cell& cell, std::span<const std::uint32_t> sources, const CellBounds& bounds,
                 const CellPoints& X, CellGradients& A) const noexcept override;
  const CellLoops& loops() const override { return loops_; }
  bool fold_candidates(std::uint32_t i, Cell& cell, CellPoints& X) const noexcept override;
  bool covers(const Vec3& X) const noexcept override { return !is_in_needle({X, 0}); }
  Mat3 gradient(const Vec3& X) const noexcept override;

 private:
  static constexpr double kResolution = 6;  // mm
  bool is_in_needle(const Cell& cell) const noexcept;
  void add_ring_bounds(std::uint32_t r, double distance, CellBounds& bounds) const noexcept;
  void add_piece_bounds(const NearField::Piece& piece, double distance, CellBounds& bounds) const noexcept;

  const NearField& near_;
  const SmoothField* smooth_;
  double clearance_;
  const CellLoops& loops_;
  NearBounds bounds_;
  Vec3 min_, max_;  // of the tissue
  Cell domain_;
  const NeedleRings* rings_ = nullptr;
  std::span<const Vec3> ring_forces_;
  std::span<const NearField::Piece> pieces_;
  std::vector<std::uint32_t> piece_of_;  // of each ring
  std::size_t fold_candidate_every_ = 1;
  mutable std::vector<NearSource> chosen_;
};

}  // namespace brachy
