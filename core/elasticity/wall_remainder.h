#pragma once

#include <vector>

#include "core/elasticity/elastic_body.h"
#include "core/elasticity/remainder.h"

namespace brachy {

/// The remainder of the model `elastic` in tissue of one modulus whose faces are all held: forces on points of the
/// faces, and no volume cells. Condensed, they leave G − G_wᵀ G_ww⁻¹ G_w of Kelvin's solution G
/// (apps/lab/reference/MODEL_STUDY.md, "The rule", 3).
///
/// Cells and cores are chosen on the references (tests/reference/README.md, "In ticks"): walls of wider cores give way,
/// those of narrower ones hold what lies between the cells' points too well.
/// Set-up some N³ operations for N = 3 · 6 · kCells² = 882: 0.1 s with its tables.
class WallRemainder : public Remainder {
 public:
  static constexpr int kCells = 7;       ///< n × n a face, points at their centres
  static constexpr double kCore = 0.64;  ///< core radius of a point, in √(area of its cell)

  /// The body's free faces and regions are not looked at.
  explicit WallRemainder(const ElasticBody& body);

  /// Where `a` and `b` are one object, half of the work. N²(|a| + |b|) + N |a| |b| operations.
  Parts between(const PointGroups& a, const PointGroups& b) const override;
  /// One solution for all sets of forces, then a Kelvin sum over the walls' points.
  Parts fields(std::span<const Vec3> X, const PointGroups& b, const Eigen::MatrixXd& forces) const override;
  std::size_t bytes() const override;

  std::size_t size() const { return points_.size(); }  ///< points on all faces

 private:
  double poisson_;
  std::vector<Vec3> points_;  // mm
  std::vector<double> s_;     // c²/2 of each, mm²
  Eigen::MatrixXd lower_;     // L, with L Lᵀ = G_ww
};

}  // namespace brachy
