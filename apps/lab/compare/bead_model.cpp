#include "apps/lab/compare/bead_model.h"

#include <cmath>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "core/elasticity/compact/compact_kernel.h"
#include "core/elasticity/kelvin.h"
#include "core/kernels/kernels.h"

namespace brachy {
namespace {

// n vectors as c rows per vector: cn × 3/c.
Eigen::MatrixXd stacked(std::span<const Vec3> vectors, Eigen::Index c) {
  Eigen::MatrixXd all(c * static_cast<Eigen::Index>(vectors.size()), 3 / c);
  for (std::size_t i = 0; i < vectors.size(); ++i)
    for (Eigen::Index k = 0; k < 3; ++k)
      all(c == 1 ? static_cast<Eigen::Index>(i) : 3 * static_cast<Eigen::Index>(i) + k, c == 1 ? k : 0) =
          vectors[i][k];
  return all;
}

void add_scalar_kernels(double extent, std::vector<BeadKernel>& kernels) {
  for_each_kernel([&](auto psi) {
    for (const double multiple : {1.0, 2.0, 3.0, 4.0, 6.0, 10.0}) {
      const double a = multiple * extent;
      kernels.push_back({std::string(psi.kName),
                         {{"support_mm", a}},
                         [=](const Vec3& x) { return Mat3(psi.value(x.norm() / a) * Mat3::Identity()); },
                         true});
    }
  });
}

void add_compact_kernels(double extent, std::vector<BeadKernel>& kernels) {
  constexpr double kPoisson = 0.49;
  for (const double multiple : {1.5, 3.0, 6.0, 12.0})
    for (const double core_share : {0.05, 0.1, 0.2, 0.4, 0.8}) {
      const double wall = multiple * extent, core = core_share * wall;
      const CompactKernel kernel(fit_compact(kPoisson, core, wall).terms, 1);
      kernels.push_back({"compact_elastic",
                         {{"wall_mm", wall}, {"core_mm", core}, {"poisson", kPoisson}},
                         [=](const Vec3& x) { return kernel.value(x); },
                         false});
    }
}

void add_elastic_kernels(double extent, std::vector<BeadKernel>& kernels) {
  for (const double multiple : {0.25, 0.5, 1.0, 2.0, 4.0})
    for (const double poisson : {0.3, 0.45, 0.49, 0.499}) {
      const double core = multiple * extent;
      kernels.push_back({"elastic",
                         {{"core_mm", core}, {"poisson", poisson}},
                         [=](const Vec3& x) { return kelvin(x, core * core, poisson); },
                         false});
    }
}

}  // namespace

std::vector<BeadKernel> bead_kernels(double extent) {
  std::vector<BeadKernel> kernels;
  add_scalar_kernels(extent, kernels);
  add_compact_kernels(extent, kernels);
  add_elastic_kernels(extent, kernels);
  return kernels;
}

BeadModel::BeadModel(const BeadKernel& kernel, std::span<const Vec3> landmarks)
    : kernel_(kernel), landmarks_(landmarks.begin(), landmarks.end()), c_(kernel.is_scalar ? 1 : 3) {
  Vec3 least = landmarks_[0], most = landmarks_[0];
  for (const Vec3& p : landmarks_) {
    least = least.cwiseMin(p);
    most = most.cwiseMax(p);
  }
  centre_ = 0.5 * (least + most);
  extent_ = (most - least).maxCoeff();
  Eigen::MatrixXd K = kernel_matrix(landmarks_);
  scale_ = 1 / K.diagonal().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale_ * K);
  eigenvalues_ = eigen.eigenvalues().cwiseMax(0);  // rounding leaves −1e-15
  vectors_ = eigen.eigenvectors();
  basis_ = vectors_.transpose() * affine_basis(landmarks_);
}

Eigen::MatrixXd BeadModel::affine_basis(std::span<const Vec3> X) const {
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(c_ * static_cast<Eigen::Index>(X.size()), 4 * c_);
  for (std::size_t i = 0; i < X.size(); ++i) {
    const Vec3 x = (X[i] - centre_) / extent_;
    for (Eigen::Index r = 0; r < c_; ++r) {
      const Eigen::Index row = c_ * static_cast<Eigen::Index>(i) + r;
      B(row, r) = 1;
      for (Eigen::Index k = 0; k < 3; ++k) B(row, (k + 1) * c_ + r) = x[k];
    }
  }
  return B;
}

Eigen::MatrixXd BeadModel::kernel_matrix(std::span<const Vec3> X) const {
  Eigen::MatrixXd K(c_ * static_cast<Eigen::Index>(X.size()),
                    c_ * static_cast<Eigen::Index>(landmarks_.size()));
  for (std::size_t j = 0; j < landmarks_.size(); ++j)
    for (std::size_t i = 0; i < X.size(); ++i)
      K.block(c_ * static_cast<Eigen::Index>(i), c_ * static_cast<Eigen::Index>(j), c_, c_) =
          scale_ * kernel_.value(X[i] - landmarks_[j]).topLeftCorner(c_, c_);
  return K;
}

BeadModel::Solution BeadModel::solve(std::span<const Vec3> displacements, const Smoothing& smoothing) const {
  Solution s;
  s.shrink = (eigenvalues_.array() + smoothing.lambda).inverse();
  Eigen::MatrixXd rest = vectors_.transpose() * stacked(displacements, c_);
  if (smoothing.affine) {
    const Eigen::MatrixXd weighted = s.shrink.asDiagonal() * basis_;
    s.gram = (basis_.transpose() * weighted).ldlt().solve(Eigen::MatrixXd::Identity(4 * c_, 4 * c_));
    s.coefficients = s.gram * (weighted.transpose() * rest);
    rest -= basis_ * s.coefficients;
  }
  s.weights = vectors_ * (s.shrink.asDiagonal() * rest);
  return s;
}

double BeadModel::leave_one_out(std::span<const Vec3> displacements, const Smoothing& smoothing) const {
  // Left out, landmark i is missed by (R_ii)⁻¹ y_i, with y = R d.
  const Solution s = solve(displacements, smoothing);
  double sum = 0;
  for (Eigen::Index i = 0; i < vectors_.rows(); i += c_) {
    const Eigen::MatrixXd rows = vectors_.middleRows(i, c_);
    const Eigen::MatrixXd shrunk = rows * s.shrink.asDiagonal();
    Eigen::MatrixXd R = shrunk * rows.transpose();
    if (smoothing.affine) {
      const Eigen::MatrixXd share = shrunk * basis_;
      R -= share * s.gram * share.transpose();
    }
    sum += R.ldlt().solve(s.weights.middleRows(i, c_)).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(landmarks_.size()));
}

std::vector<Vec3> BeadModel::evaluate(std::span<const Vec3> X, std::span<const Vec3> displacements,
                                      const Smoothing& smoothing) const {
  const Solution s = solve(displacements, smoothing);
  Eigen::MatrixXd u = kernel_matrix(X) * s.weights;
  if (smoothing.affine) u += affine_basis(X) * s.coefficients;
  std::vector<Vec3> all(X.size());
  for (std::size_t i = 0; i < X.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    all[i] = c_ == 1 ? Vec3(u.row(at).transpose()) : Vec3(u.col(0).segment<3>(3 * at));
  }
  return all;
}

}  // namespace brachy
