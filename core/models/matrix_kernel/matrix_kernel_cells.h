#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/work_budget.h"
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

  /// Tissue and fields must outlive this. `smooth`: none for the compact models. `budget`: at how many rings folds are
  /// looked for.
  MatrixKernelCells(const Tissue& tissue, const NearField& near, const SmoothField* smooth,
                    double needle_radius, SimdTarget target, std::size_t max_rings,
                    const WorkBudget& budget = {});

  /// Sets the field: that of `ring_forces` (N, one for each ring), and as far as they are far of their `pieces`.
  /// The tissue lies within `margin` mm of its box.
  void set_field(const NeedleRings& rings, std::span<const Vec3> ring_forces,
                 std::span<const NearField::Piece> pieces, double margin = 0) noexcept;

  std::size_t sources() const override { return field_.ring_forces.size(); }
  Cell domain() const override { return domain_; }
  bool reaches_everywhere() const override { return bounds_.is_kelvin(); }
  double resolution() const override { return kResolution; }
  std::size_t narrow(const Cell& cell, std::span<const std::uint32_t> from, std::uint32_t* to,
                     CellBounds& bounds) const noexcept override;
  void bound_curvature(const Cell& cell, CellBounds& bounds) const noexcept override;
  void gradients(const Cell& cell, std::span<const std::uint32_t> sources, const CellBounds& bounds,
                 const CellPoints& X, CellGradients& A) const noexcept override;
  const CellLoops& loops() const override { return loops_; }
  bool fold_candidates(std::uint32_t i, Cell& cell, CellPoints& X) const noexcept override;
  bool covers(const Vec3& X) const noexcept override { return distance_to_needles(X) >= clearance_; }
  double clearance() const { return clearance_; }            ///< mm
  double distance_to_needles(const Vec3& X) const noexcept;  ///< from the nearest axis of a shaft, mm
  Mat3 gradient(const Vec3& X) const noexcept override;

 private:
  static constexpr double kResolution = 6;  // mm
  static constexpr double kStraight =
      0.05;  // mm: rings on one line to so much are one straight piece of needle
  void find_needles() noexcept;
  bool is_in_needle(const Cell& cell) const noexcept;
  bool is_straight(std::size_t first, std::size_t last) const noexcept;
  /// A force as the bounds need it.
  struct Force {
    Vec3 direction;    // unit
    double size = 0;   // N, times the near field's scale
    double aside = 0;  // mm: how far along it the points lie that carry it
    double cubed = 1;  // the mean of 1/d³ over them is at most that of 1/d² to the power of 3/2, times this
  };
  static Force force_of(const Vec3& force, double scale);
  void add_ring_bounds(std::uint32_t r, double distance, CellBounds& bounds) const noexcept;
  void add_piece_bounds(std::uint32_t p, const Cell& cell, CellBounds& bounds) const noexcept;

  void take_bounded_forces() noexcept;
  void choose_fold_candidates() noexcept;
  double fold_distance(std::size_t ring) const noexcept;
  BoundedCell bounded(const Cell& cell) const noexcept;
  void add_kelvin_bounds(const Cell& cell, CellBounds& bounds) const noexcept;

  struct Segment {
    Segment(const Vec3& a, const Vec3& b)
        : from(a), way(b - a), inverse(1 / std::max(way.squaredNorm(), 1e-12)) {}
    double squared_distance(const Vec3& X) const {
      const Vec3 x = X - from;
      return (x - std::clamp(inverse * x.dot(way), 0.0, 1.0) * way).squaredNorm();
    }
    Vec3 from, way;
    double inverse;  // of its squared length
  };

  const NearField& near_;
  const SmoothField* smooth_;
  double clearance_;
  const CellLoops& loops_;
  NearBounds bounds_;
  KelvinBounds kelvin_;  // of bounds_, where the near part is Kelvin's solution
  struct Extent {
    Vec3 rest_min, rest_max;  // of the tissue …
    Vec3 min, max;            // … and with the field's margin
  };
  Extent extent_;
  Cell domain_;
  /// The field that was set, and what follows from it.
  struct Field {
    const NeedleRings* rings = nullptr;
    std::span<const Vec3> ring_forces;
    std::span<const NearField::Piece> pieces;
    std::vector<Segment> needles;                    // straight pieces that rings enclose
    std::vector<std::uint32_t> piece_of;             // of each ring
    std::vector<Force> forces;                       // of the rings …
    std::vector<std::array<Force, 2>> piece_forces;  // … and of the pieces
  };
  Field field_;
  WorkBudget budget_;
  /// Where folds are looked for.
  struct FoldSearch {
    Allowance may;                                            // with these rings
    std::vector<std::pair<double, std::uint32_t>> strengths;  // of pieces, each with its strongest ring
    std::vector<std::uint32_t> strongest;  // rings, ascending, that alone are searched; empty: by number
  };
  FoldSearch folds_;
  const NearLoops& near_loops_;
  /// Kelvin's solution: of the rings and pieces about the domain's centre, for the loops.
  struct Bounded {
    std::vector<BoundedForces> forces;
    std::vector<BoundedCorrections> corrections;
    std::size_t correction_work = 0;  // as CellBounds::work
  };
  Bounded bounded_;
  mutable std::vector<NearSource> chosen_;
};

}  // namespace brachy
