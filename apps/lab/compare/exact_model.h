#pragma once

#include <memory>
#include <string>

#include <Eigen/Core>

#include "apps/lab/comparators/compared_model.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "core/models/matrix_kernel/matrix_models.h"

namespace brachy {

/// A matrix model without the approximations of the daemon's tick: the kernel's columns for the landmarks,
/// times K⁻¹, are kept for all points as floats, and a tick multiplies; other landmarks need another set-up.
class ExactModel : public ComparedModel {
 public:
  /// `model`: of all_model_names().
  explicit ExactModel(std::string model_name) : model_name_(std::move(model_name)) {}

  void set_up(const ComparedScene& scene) override;
  void tick(std::span<const Vec3> displacements) override;
  void read(std::span<Vec3> u) const override;
  std::vector<Vec3> displacements_at(std::span<const Vec3> X) const override;
  std::vector<double> jacobians(std::span<const Vec3> X) const override;

 private:
  std::vector<Vec3> forces() const;

  std::string model_name_;
  std::unique_ptr<MatrixKernel> kernel_;
  std::unique_ptr<MatrixKernelSystem> system_;
  Eigen::MatrixXf columns_;     // 3N × 3n
  Eigen::VectorXf moving_, u_;  // 3n, 3N, mm
};

}  // namespace brachy
