#include "apps/lab/comparators/paper_csrbf.h"

#include <algorithm>
#include <stdexcept>

#include <Eigen/Cholesky>

#include "core/solve/rbf_field.h"

namespace brachy {

std::vector<Vec3> paper_anchors(const ElasticBody& body, std::span<const Vec3> landmarks,
                                const Anchors::Options& options) {
  constexpr std::size_t kSurfacePoints = 1200;
  if (body.regions.empty()) return {};
  std::vector<Vec3> surface;
  for (const SurfacePatch& patch : body.regions.front()->surface(kSurfacePoints))
    surface.push_back(patch.position);
  const Anchors anchors(surface, options);
  std::vector<Vec3> kept;
  for (const Vec3& anchor : anchors.positions())
    if (std::ranges::none_of(landmarks,
                             [&](const Vec3& p) { return (p - anchor).norm() < options.clearance_mm; }))
      kept.push_back(anchor);
  return kept;
}

void PaperCsrbf::set_up(const ComparedScene& scene) {
  points_ = scene.points;
  positions_ = scene.landmarks;
  for (const Vec3& anchor : paper_anchors(scene.body, scene.landmarks)) positions_.push_back(anchor);
  u_.assign(points_.size(), Vec3::Zero());
}

void PaperCsrbf::tick(std::span<const Vec3> displacements) {
  const auto n = static_cast<Eigen::Index>(positions_.size());
  std::visit(
      [&](auto psi) {
        Eigen::MatrixXd K(n, n);
        Eigen::Matrix<double, Eigen::Dynamic, 3> d = Eigen::Matrix<double, Eigen::Dynamic, 3>::Zero(n, 3);
        for (Eigen::Index i = 0; i < n; ++i) {
          const auto row = static_cast<std::size_t>(i);
          if (row < displacements.size()) d.row(i) = displacements[row].transpose();
          for (Eigen::Index j = 0; j < n; ++j)
            K(i, j) = psi.value((positions_[row] - positions_[static_cast<std::size_t>(j)]).norm() /
                                support_radius_);
        }
        const Eigen::LLT<Eigen::MatrixXd> factor(K);
        if (factor.info() != Eigen::Success) throw std::runtime_error("K is singular to rounding");
        weights_ = factor.solve(d);
        for (std::size_t q = 0; q < points_.size(); ++q) {
          Vec3 sum = Vec3::Zero();
          for (std::size_t i = 0; i < positions_.size(); ++i)
            sum += psi.value((points_[q] - positions_[i]).norm() / support_radius_) *
                   weights_.row(static_cast<Eigen::Index>(i)).transpose();
          u_[q] = sum;
        }
      },
      kernel_);
}

bool PaperCsrbf::move(std::span<const Vec3> landmarks) {
  std::ranges::copy(landmarks, positions_.begin());
  return true;
}

void PaperCsrbf::read(std::span<Vec3> u) const {
  std::ranges::copy(u_, u.begin());
}

std::vector<Vec3> PaperCsrbf::displacements_at(std::span<const Vec3> X) const {
  std::vector<Vec3> u;
  for (const Vec3& x : X) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      const double r = (x - positions_[i]).norm() / support_radius_;
      sum += std::visit([r](auto psi) { return psi.value(r); }, kernel_) *
             weights_.row(static_cast<Eigen::Index>(i)).transpose();
    }
    u.push_back(sum);
  }
  return u;
}

std::vector<double> PaperCsrbf::jacobians(std::span<const Vec3> X) const {
  std::vector<Vec3> weights;
  for (Eigen::Index i = 0; i < weights_.rows(); ++i) weights.push_back(weights_.row(i).transpose());
  const RbfField field{kernel_, support_radius_, positions_, weights};
  std::vector<double> det;
  for (const Vec3& x : X) det.push_back(field.jacobian(x));
  return det;
}

}  // namespace brachy
