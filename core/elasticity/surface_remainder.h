#pragma once

#include <vector>

#include "core/elasticity/elastic_body.h"
#include "core/elasticity/remainder.h"

namespace brachy {

/// Chosen on the reference scenes (tests/reference/MODEL_STUDY.md, "The rule").
struct SurfaceRemainderOptions {
  int capsule_points = 200;   ///< about this many on a region's surface; 400 cost four times as much
  int wall_cells = 5;         ///< n × n a held face, points at their centres
  int free_cells = 8;         ///< the same for a free face
  double wall_core = 0.7;     ///< core radius of a point on a box face, in √(area of its cell)
  double capsule_core = 0.7;  ///< the same on a region's surface
};

/// The remainder of the model `elastic`: forces on points of the held faces, the free faces and the region's
/// surface, and no volume cells. The surfaces are condensed one after the other (tests/reference/MODEL_STUDY.md,
/// "The rule", 3 to 5):
///
///   held faces     G̃ = G − G_wᵀ G_ww⁻¹ G_w
///   free faces     G̃ + v_fᵀ [(½ + κ_f)⁻¹ − 1] v_f, spectrum of κ_f clipped to [−0.49, ½]
///   region         Q = G − (that) + vᵀv,  P = vᵀ M⁻¹ v,  M = ½(k+1) I + (k−1) κ
///
/// where for a surface of points with normals and areas A, in the kernel C condensed so far: L Lᵀ = C(surface,
/// surface), v = L⁻¹ C(surface, ·), and κ = sym(Lᵀ A T L⁻ᵀ) is the elastic Neumann–Poincaré operator, T the
/// tractions there of forces there. k is the region's shear modulus over that outside; with no region, or k = 1, P
/// is empty.
///
/// Set-up some N³ operations for N = 3 · (number of points), about 1,050. One region at most: throws UserError for
/// more.
class SurfaceRemainder : public Remainder {
 public:
  explicit SurfaceRemainder(const ElasticBody& body, const SurfaceRemainderOptions& options = {});

  /// Where `a` and `b` are one object, half of the work. N²(|a| + |b|) + N |a| |b| operations.
  Parts between(const PointGroups& a, const PointGroups& b) const override;
  /// One solution for all sets of forces, then two Kelvin sums over the surfaces' points.
  Parts fields(std::span<const Vec3> X, const PointGroups& b, const Eigen::MatrixXd& forces) const override;
  std::size_t bytes() const override;

  std::size_t size() const { return points_.size(); }  ///< points on all surfaces

 private:
  struct Joined;
  Joined join(std::span<const SurfacePatch> patches, double core);
  Eigen::MatrixXd spectral(std::span<const SurfacePatch> patches, const Joined& joined) const;
  void images_of(Eigen::MatrixXd& rows) const;
  void weigh(Eigen::MatrixXd& images) const;

  double poisson_;
  std::vector<Vec3> points_;                         // of the held faces, the free faces, the region; mm
  std::vector<double> s_;                            // c²/2 of each, mm²
  Eigen::Index walls_ = 0, free_ = 0, capsule_ = 0;  // rows of each, 3 a point
  // With h(y) = L⁻¹ G(points, y), Q(x, y) = h(x)ᵀ D h(y); D = I but for the free faces' rows, where it is −U Uᵀ.
  Eigen::MatrixXd lower_;      // L, N × N, of all surfaces
  Eigen::MatrixXd free_root_;  // U, with U Uᵀ = (½ + κ_f)⁻¹ − 1
  Eigen::MatrixXd stiffness_;  // Cholesky factor of M
};

}  // namespace brachy
