#include "apps/lab/comparators/global_spline.h"

#include <cmath>
#include <stdexcept>

#include <Eigen/SVD>

namespace brachy {
namespace {

Eigen::Index index(std::size_t i) {
  return static_cast<Eigen::Index>(i);
}

/// Orthonormal directions along which the points spread, over the spread: rows, 1/mm.
Eigen::Matrix<double, Eigen::Dynamic, 3> spread(const std::vector<Vec3>& points, const Vec3& centre) {
  constexpr double kLeastShare = 1e-6;
  Eigen::Matrix<double, Eigen::Dynamic, 3> P(index(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) P.row(index(i)) = (points[i] - centre).transpose();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(P, Eigen::ComputeThinV);
  const Eigen::VectorXd& s = svd.singularValues();
  Eigen::Index rank = 0;
  while (rank < s.size() && s[rank] > 0 && s[rank] > kLeastShare * s[0]) ++rank;
  return s.head(rank).cwiseInverse().asDiagonal() * svd.matrixV().leftCols(rank).transpose();
}

}  // namespace

SplineBasis SplineBasis::thin_plate() {
  return {[](double r) { return r; }, 1};
}

SplineBasis SplineBasis::multiquadric(double c) {
  return {[c](double r) { return std::sqrt(r * r + c * c); }, 0};
}

SplineMap::SplineMap(SplineBasis basis, std::vector<Vec3> positions, std::size_t m)
    : basis_(std::move(basis)), positions_(std::move(positions)), centre_(Vec3::Zero()), directions_(0, 3) {
  const Eigen::Index n = index(positions_.size());
  for (const Vec3& p : positions_) centre_ += p / static_cast<double>(n);
  if (basis_.degree > 0) directions_ = spread(positions_, centre_);
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(matrix());
  if (!lu.isInvertible()) throw std::runtime_error("two landmarks coincide");
  weights_ = lu.solve(Eigen::MatrixXd::Identity(lu.rows(), index(m)));
}

Eigen::MatrixXd SplineMap::matrix() const {
  const Eigen::Index n = index(positions_.size()), q = 1 + directions_.rows();
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n + q, n + q);
  for (Eigen::Index i = 0; i < n; ++i) M.row(i) = basis_at(positions_[static_cast<std::size_t>(i)]);
  M.bottomLeftCorner(q, n) = M.topRightCorner(n, q).transpose();
  return M;
}

Eigen::RowVectorXd SplineMap::basis_at(const Vec3& x) const {
  const Eigen::Index n = index(positions_.size());
  Eigen::RowVectorXd row(n + 1 + directions_.rows());
  for (Eigen::Index i = 0; i < n; ++i)
    row[i] = basis_.phi((x - positions_[static_cast<std::size_t>(i)]).norm());
  row[n] = 1;
  row.tail(directions_.rows()) = (directions_ * (x - centre_)).transpose();
  return row;
}

Eigen::MatrixXd SplineMap::influence(std::span<const Vec3> X) const {
  Eigen::MatrixXd result(index(X.size()), weights_.cols());
  for (std::size_t i = 0; i < X.size(); ++i) result.row(index(i)).noalias() = basis_at(X[i]) * weights_;
  return result;
}

void GlobalSpline::set_up(const ComparedScene& scene) {
  std::vector<Vec3> positions = scene.landmarks;
  if (holds_walls_)
    for (const Vec3& wall : wall_points(scene.body)) positions.push_back(wall);
  map_ = std::make_unique<SplineMap>(basis_, std::move(positions), scene.landmarks.size());
  influence_ = map_->influence(scene.points).cast<float>();
  moving_.setZero(index(scene.landmarks.size()), 3);
  u_.setZero(index(scene.points.size()), 3);
}

void GlobalSpline::tick(std::span<const Vec3> displacements) {
  for (std::size_t i = 0; i < displacements.size(); ++i)
    moving_.row(index(i)) = displacements[i].cast<float>().transpose();
  u_.noalias() = influence_ * moving_;
}

void GlobalSpline::read(std::span<Vec3> u) const {
  for (std::size_t i = 0; i < u.size(); ++i) u[i] = u_.row(index(i)).cast<double>().transpose();
}

std::vector<Vec3> GlobalSpline::displacements_at(std::span<const Vec3> X) const {
  const Eigen::MatrixXd field = map_->influence(X) * moving_.cast<double>();
  std::vector<Vec3> u(X.size());
  for (std::size_t i = 0; i < X.size(); ++i) u[i] = field.row(index(i)).transpose();
  return u;
}

std::vector<Vec3> wall_points(const ElasticBody& body, int per_side) {
  std::vector<Vec3> points;
  for (std::size_t face = 0; face < body.held.size(); ++face) {
    if (!body.held[face]) continue;
    const Eigen::Index across = index(face / 2), first = (across + 1) % 3, second = (across + 2) % 3;
    for (int i = 0; i < per_side; ++i)
      for (int j = 0; j < per_side; ++j) {
        Vec3 p = body.face_centre(face);
        p[first] += body.box_size[first] * ((i + 0.5) / per_side - 0.5);
        p[second] += body.box_size[second] * ((j + 0.5) / per_side - 0.5);
        points.push_back(p);
      }
  }
  return points;
}

}  // namespace brachy
