#pragma once

#include <memory>
#include <string>

#include <Eigen/Core>

#include "apps/comparators/compared_model.h"
#include "core/ladder/ladder.h"
#include "core/ladder/ladder_system.h"

namespace brachy {

/// A matrix rung of the ladder without what the daemon rounds off to be quick: the kernel's columns for the landmarks,
/// times K⁻¹, are kept for all points as floats, and a tick multiplies; other landmarks are another set-up.
class ExactModel : public ComparedModel {
 public:
  /// `rung`: of rung_names().
  explicit ExactModel(std::string rung) : rung_(std::move(rung)) {}

  void set_up(const ComparedScene& scene) override;
  void tick(std::span<const Vec3> displacements) override;
  void read(std::span<Vec3> u) const override;
  std::vector<Vec3> displacements_at(std::span<const Vec3> X) const override;
  std::vector<double> jacobians(std::span<const Vec3> X) const override;

 private:
  std::vector<Vec3> forces() const;

  std::string rung_;
  std::unique_ptr<MatrixKernel> kernel_;
  std::unique_ptr<LadderSystem> system_;
  Eigen::MatrixXf columns_;     // 3N × 3n
  Eigen::VectorXf moving_, u_;  // 3n, 3N, mm
};

}  // namespace brachy
