#include "core/elasticity/wall_remainder.h"

#include <Eigen/Cholesky>

#include "core/base/error.h"
#include "core/elasticity/kelvin_sums.h"

namespace brachy {

using Eigen::Index;
using Eigen::Lower;
using Eigen::MatrixXd;

WallRemainder::WallRemainder(const ElasticBody& body) : poisson_(body.poisson) {
  PointGroups walls;
  for (std::size_t f = 0; f < body.held.size(); ++f) {
    if (!body.held[f]) continue;
    const Index axis = static_cast<Index>(f / 2), a = (axis + 1) % 3, b = (axis + 2) % 3;
    const double da = body.box_size[a] / kCells, db = body.box_size[b] / kCells;
    for (int i = 0; i < kCells; ++i)
      for (int j = 0; j < kCells; ++j) {
        Vec3 centre = body.face_centre(f);
        centre[a] += (i + 0.5 - 0.5 * kCells) * da;
        centre[b] += (j + 0.5 - 0.5 * kCells) * db;
        walls.begin_group();
        walls.add(centre, 0.5 * kCore * kCore * da * db, 1);
      }
  }
  walls.finish();
  const Eigen::LLT<MatrixXd> factor(kelvin_between(walls, walls, poisson_));
  if (factor.info() != Eigen::Success)
    throw UserError(
        "[box]: kernel = \"elastic\" cannot tell points of its faces apart; make size_mm more even");
  lower_ = factor.matrixL();
  points_ = walls.points;
  s_ = walls.s;
}

Remainder::Parts WallRemainder::between(const PointGroups& a, const PointGroups& b) const {
  const auto images = [&](const PointGroups& groups) {
    MatrixXd h = kelvin_rows(points_, s_, groups, poisson_);
    lower_.triangularView<Lower>().solveInPlace(h);
    return h;
  };
  const MatrixXd u = images(a);
  Parts parts;
  if (&a == &b) {
    parts.held = MatrixXd::Zero(u.cols(), u.cols());
    parts.held.selfadjointView<Lower>().rankUpdate(u.transpose(), 1);
    parts.held.triangularView<Eigen::StrictlyUpper>() = parts.held.transpose();
  } else {
    parts.held = u.transpose() * images(b);
  }
  return parts;
}

Remainder::Parts WallRemainder::fields(std::span<const Vec3> X, const PointGroups& b,
                                       const MatrixXd& forces) const {
  MatrixXd strengths = kelvin_rows(points_, s_, b, poisson_) * forces;
  lower_.triangularView<Lower>().solveInPlace(strengths);
  lower_.triangularView<Lower>().transpose().solveInPlace(strengths);
  Parts parts;
  parts.held = kelvin_fields(X, points_, s_, strengths, poisson_);
  return parts;
}

std::size_t WallRemainder::bytes() const {
  return static_cast<std::size_t>(lower_.size() + 4 * lower_.rows() / 3) * sizeof(double);
}

}  // namespace brachy
