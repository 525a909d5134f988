#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/models/blended/region_distance.h"

namespace brachy {

/// Which tissue a point belongs to: w_m(X) ≥ 0 for tissues m = 0 … M − 1 with Σ w_m² = 1, as a kernel of
/// several tissues requires (core/DESIGN.md, section 2): K(x, y) = Σ_m w_m(x) w_m(y) C_m(x − y) is positive
/// definite wherever the C_m are, and K(x, x) = 1.
///
/// Tissue 0 is what lies in no region; a later region lies over an earlier one. Across a region's surface an angle
/// θ = π/2 · S(½ − distance/blend) goes from 0 to π/2 over `blend` mm, S(t) = t³(10 − 15t + 6t²); the region
/// takes sin θ of what later ones left and leaves cos θ, so that squares add up to 1 by construction. w is C²
/// where the distance is, and exactly 0 or 1 outside the blends. Regions of one tissue add their squares, so that
/// there is no seam between them.
/// Threads: const functions from any. Real-time: they do not allocate.
class Membership {
 public:
  struct Part {
    std::shared_ptr<const RegionDistance> region;
    double blend_mm;     ///< > 0, half of it on either side of the surface
    std::size_t tissue;  ///< < tissues(); 0 returns to what lies in no region
  };
  /// w_m and its gradient at a cell's points.
  struct CellShares {
    alignas(64) float w[CellPoints::kCount], g[3][CellPoints::kCount];
  };
  /// The same at points within `radius` of `centre`, in single precision.
  void shares(const Vec3& centre, double radius, const CellPoints& X,
              std::span<CellShares> shares) const noexcept;

  /// The most work of that, in pairs of InjectivitySearch.
  std::size_t work() const;

  /// Upper bounds of w and its derivatives over a ball.
  struct ShareBounds {
    double value = 0;  ///< w
    double slope = 0;  ///< |∇w|, 1/mm
    double bend = 0;   ///< |D²w| (Frobenius), 1/mm²
    double bends = 0;  ///< Σ_k |∂²w/∂x_k²|, 1/mm²
    double third = 0;  ///< Σ_k |∂²∇w/∂x_k²|, 1/mm³
  };

  /// Largest |dw/d distance| of one blend, over its width: max 30t²(1−t)² π/2 cos(π/2 S), at t = 0.40627. A
  /// displacement d across a blend towards tissue that a landmark does not share folds there unless blend >
  /// kMaxSlope |d|.
  static constexpr double kMaxSlope = 2.38523963934774;

  static constexpr std::size_t kMaxTissues = 16;

  /// `parts` in the scene's order; `tissues` ≤ kMaxTissues.
  Membership(std::vector<Part> parts, std::size_t tissues);

  std::size_t tissues() const { return tissues_; }
  /// w_m(X), `w` of size tissues().
  void shares(const Vec3& X, std::span<double> w) const noexcept;
  /// The same and ∇w_m(X), 1/mm.
  void shares(const Vec3& X, std::span<double> w, std::span<Vec3> gradients) const noexcept;
  /// Their bounds over the ball of `radius` about X, `bounds` of size tissues(). Where regions of one
  /// tissue meet another inside the ball, higher derivatives are not known: 10³⁰.
  void bound(const Vec3& X, double radius, std::span<ShareBounds> bounds) const noexcept;

 private:
  std::vector<Part> parts_;
  std::size_t tissues_;
};

}  // namespace brachy
