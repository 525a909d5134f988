#pragma once

#include <vector>

#include "core/compact/compact_fit.h"
#include "core/elastic/elastic_body.h"
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

enum class CompactRung {
  kMultiscale,      ///< Σ w_k ψ3,1(r/a_k) I
  kCompactElastic,  ///< Σ [w_k ψ3,1(r/a_k) I + v_k Φ(x/a_k)]
};

/// Share of the needle's radius that is the core of the kernel that compact rungs are fitted to.
inline constexpr double kCompactCore = 1.25;

/// The rungs with compact support and elastic weights: positive definite for any distinct landmarks, exactly 0 from the
/// largest support on. Boxes and regions are not seen, but for the support that ends at the nearest wall. (Regions with a
/// support of their own: core/heterogeneous.)
class CompactKernel : public MatrixKernel {
 public:
  /// `compliance`, mm/N, multiplies the terms' weights. At least one weight is positive.
  CompactKernel(std::vector<CompactTerm> terms, double compliance);

  /// Fitted to `body`: its Poisson's ratio, its needle of core 1.25 R, the nearest wall from the box's middle (half the
  /// least side). These rungs know one modulus and take body.shear_modulus, whatever region a landmark lies in:
  /// displacements do not depend on it, forces are proportional to it. `residual`: of the fit (compact_fit.h).
  static CompactKernel of_body(const ElasticBody& body, CompactRung rung, double* residual = nullptr);

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
