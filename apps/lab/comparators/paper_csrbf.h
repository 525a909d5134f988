#pragma once

#include <Eigen/Core>

#include "apps/lab/comparators/compared_model.h"
#include "core/kernels/kernels.h"
#include "core/solve/anchors.h"

namespace brachy {

/// The paper's anchors for a body: `options` on 1,200 points of its first region's surface, those too near to a
/// landmark omitted; mm. None where there is no region.
std::vector<Vec3> paper_anchors(const ElasticBody& body, std::span<const Vec3> landmarks,
                                const Anchors::Options& options = {});

/// The paper's section 2 unchanged: K and its Cholesky factor from scratch in each tick, then one loop over all
/// points and all landmarks, with Eigen, in double, for the processor every build runs on
/// (apps/bench/paper_baseline.h is the same for this machine's). With the paper's eight anchors.
class PaperCsrbf : public ComparedModel {
 public:
  /// `support_radius` in mm.
  PaperCsrbf(Kernel kernel, double support_radius) : kernel_(kernel), support_radius_(support_radius) {}

  void set_up(const ComparedScene& scene) override;
  void tick(std::span<const Vec3> displacements) override;
  bool move(std::span<const Vec3> landmarks) override;
  void read(std::span<Vec3> u) const override;
  std::vector<Vec3> displacements_at(std::span<const Vec3> X) const override;
  std::vector<double> jacobians(std::span<const Vec3> X) const override;

 private:
  Kernel kernel_;
  double support_radius_;
  std::span<const Vec3> points_;
  std::vector<Vec3> positions_;                       // landmarks, anchors
  Eigen::Matrix<double, Eigen::Dynamic, 3> weights_;  // mm
  std::vector<Vec3> u_;
};

}  // namespace brachy
