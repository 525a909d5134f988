#pragma once

#include <memory>
#include <vector>

#include "core/elasticity/elastic_body.h"
#include "core/elasticity/remainder.h"
#include "core/kernels/matrix_kernel.h"

namespace brachy {

/// The kernel of an elastic body, C = w (G − Q) + P over μ (remainder.h): Kelvin's solution near the needle, and a
/// remainder for bounds and regions, which is what sets the models `elastic` and `fem` apart.
class ElasticKernel : public MatrixKernel {
 public:
  /// `remainder` none: an unbounded, homogeneous solid.
  ElasticKernel(ElasticBody body, std::unique_ptr<const Remainder> remainder);

  /// Landmarks on a needle's shaft become rings on its surface, one alone a disc (needle_rings.h).
  PointGroups groups(std::span<const Vec3> positions, std::span<const double> cores) const override;
  Eigen::MatrixXd between(const PointGroups& a, const PointGroups& b) const override;
  Eigen::MatrixXd fields(std::span<const Vec3> X, const PointGroups& b,
                         const Eigen::MatrixXd& forces) const override;
  std::size_t bytes() const override;

  /// Σ_m (P − w Q) f / μ, w = 2/(modulus + k_m), at the points X: what tissue of relative modulus `modulus` takes
  /// from groups b (forces 3|b| × m, N) beside Kelvin's solution with the same w for each part of them.
  Eigen::MatrixXd smooth_fields(std::span<const Vec3> X, double modulus, const PointGroups& b,
                                const Eigen::MatrixXd& forces) const;
  const ElasticBody& body() const { return body_; }
  const Remainder* remainder() const { return remainder_.get(); }

 private:
  ElasticBody body_;
  std::unique_ptr<const Remainder> remainder_;
};

}  // namespace brachy
