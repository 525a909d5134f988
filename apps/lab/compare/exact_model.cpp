#include "apps/lab/compare/exact_model.h"

#include <stdexcept>

#include <Eigen/Cholesky>

namespace brachy {

void ExactModel::set_up(const ComparedScene& scene) {
  kernel_ = make_matrix_kernel(model_name_, scene.body);
  system_ = std::make_unique<MatrixKernelSystem>(*kernel_);
  if (!system_->factorize(scene.landmarks)) throw std::runtime_error("the landmarks' matrix is singular");
  const Eigen::MatrixXd& K = system_->matrix();
  const Eigen::MatrixXd inverse = K.llt().solve(Eigen::MatrixXd::Identity(K.rows(), K.cols()));
  columns_ = kernel_->fields(scene.points, kernel_->groups(scene.landmarks, {}), inverse).cast<float>();
  moving_.setZero(columns_.cols());
  u_.setZero(columns_.rows());
}

void ExactModel::tick(std::span<const Vec3> displacements) {
  for (std::size_t i = 0; i < displacements.size(); ++i)
    moving_.segment<3>(static_cast<Eigen::Index>(3 * i)) = displacements[i].cast<float>();
  u_.noalias() = columns_ * moving_;
}

void ExactModel::read(std::span<Vec3> u) const {
  for (std::size_t i = 0; i < u.size(); ++i)
    u[i] = u_.segment<3>(static_cast<Eigen::Index>(3 * i)).cast<double>();
}

std::vector<Vec3> ExactModel::forces() const {
  std::vector<Vec3> displacements(system_->size());
  for (std::size_t i = 0; i < displacements.size(); ++i)
    displacements[i] = moving_.segment<3>(static_cast<Eigen::Index>(3 * i)).cast<double>();
  return system_->solve(displacements);
}

std::vector<Vec3> ExactModel::displacements_at(std::span<const Vec3> X) const {
  return system_->evaluate(X, forces());
}

std::vector<double> ExactModel::jacobians(std::span<const Vec3> X) const {
  return system_->jacobians(X, forces());
}

}  // namespace brachy
