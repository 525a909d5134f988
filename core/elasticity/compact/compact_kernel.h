#pragma once

#include <vector>

#include "core/elasticity/compact/compact_fit.h"
#include "core/elasticity/elastic_body.h"
#include "core/kernels/matrix_kernel.h"

namespace brachy {

/// C(x) = across I + outer x xᵀ.
struct CompactValue {
  double across = 0, outer = 0;
};

/// w ψ3,1(r/a) I + v Φ(x/a) at |x| = r mm, where Φ(x) = (1−|x|)⁴₊ [ (1 + 4|x| − 20|x|²) I + 15 x xᵀ ]: divergence-free,
/// positive definite, Φ(0) = I, exactly 0 from |x| = 1 on. It is (−Δ I + ∇∇ᵀ) ψ3,2 over its value at 0, 112/3 (the way:
/// F. J. Narcowich and J. D. Ward, Math. Comp. 63 (1994) 661).
CompactValue compact_value(const CompactTerm& term, double r);

/// Core of the elastic kernel that the compact kernel is fitted to, in needle radii.
inline constexpr double kCompactCore = 1.25;

/// The kernel of `compact_elastic`: Σ [w_k ψ3,1(r/a_k) I + v_k Φ(x/a_k)], positive definite for any distinct
/// landmarks and exactly 0 from the largest support on. It does not know boxes and regions, except that its support
/// ends at the nearest wall. (Regions with a support of their own: core/models/blended.)
class CompactKernel : public MatrixKernel {
 public:
  /// `compliance`, mm/N, multiplies the terms' weights. At least one weight is positive.
  CompactKernel(std::vector<CompactTerm> terms, double compliance);

  /// Fitted to `body`: its Poisson's ratio, its needle of core 1.25 R, the nearest wall from the box's middle (half the
  /// least side). This model knows one modulus and takes body.shear_modulus, whatever region a landmark lies in:
  /// displacements do not depend on it, forces are proportional to it. `residual`: of the fit (compact_fit.h).
  static CompactKernel of_body(const ElasticBody& body, double* residual = nullptr);

  /// A point a landmark. `cores` are ignored: the kernel is one for all pairs, its core was set by the fit.
  PointGroups groups(std::span<const Vec3> positions, std::span<const double> cores) const override;
  Eigen::MatrixXd between(const PointGroups& a, const PointGroups& b) const override;
  Eigen::MatrixXd fields(std::span<const Vec3> X, const PointGroups& b,
                         const Eigen::MatrixXd& forces) const override;
  std::size_t bytes() const override { return terms_.size() * sizeof(CompactTerm); }

  /// C of two points x apart, mm/N.
  Mat3 value(const Vec3& x) const;

  /// ∇(C(x) f): row i, column j is ∂(C f)_i/∂x_j, 1 for f in N.
  Mat3 gradient(const Vec3& x, const Vec3& f) const;

  const std::vector<CompactTerm>& terms() const { return terms_; }
  double compliance() const { return compliance_; }  ///< mm/N
  double support() const { return support_; }        ///< the largest of a positive weight, mm

 private:
  std::vector<CompactTerm> terms_;  // none without weight
  double compliance_, support_ = 0;
};

}  // namespace brachy
