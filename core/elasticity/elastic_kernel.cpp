#include "core/elasticity/elastic_kernel.h"

#include <algorithm>
#include <optional>

#include "core/elasticity/kelvin_sums.h"
#include "core/elasticity/needle_rings.h"

namespace brachy {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// On a region's surface w takes the mean modulus of the two sides: tissue bonded there gives way to a force on the bond
// as a solid of that modulus would, and w stays a Cauchy matrix.

// Groups cut where their points lie in different moduli: each piece is a group of its own, in one modulus.
struct Pieces {
  Pieces(const PointGroups& groups, const ElasticBody& body) {
    std::vector<std::size_t> of_point;
    for (const Vec3& X : groups.points) {
      const double k = body.relative_modulus(X);
      of_point.push_back(static_cast<std::size_t>(std::ranges::find(moduli, k) - moduli.begin()));
      if (of_point.back() == moduli.size()) moduli.push_back(k);
    }
    for (std::size_t g = 0; g < groups.size(); ++g)
      for (std::size_t m = 0; m < moduli.size(); ++m) {
        bool any = false;
        for (std::uint32_t i = groups.first[g]; i < groups.first[g + 1]; ++i) {
          if (of_point[i] != m) continue;
          if (!any) pieces.begin_group();
          any = true;
          pieces.add(groups.points[i], {groups.s[i], groups.smooth_s[i], groups.is_landmark[i] != 0},
                     groups.weights[i]);
        }
        if (!any) continue;
        group.push_back(static_cast<Index>(g));
        modulus.push_back(m);
      }
    pieces.finish();
  }

  PointGroups pieces;
  std::vector<Index> group;          // of each piece
  std::vector<std::size_t> modulus;  // of each piece, in `moduli`
  std::vector<double> moduli;
};

// G f at the points X, the groups' forces laid on their points.
MatrixXd fields_of_groups(std::span<const Vec3> X, const PointGroups& b, const MatrixXd& forces,
                          double poisson) {
  MatrixXd of_points(static_cast<Index>(3 * b.points.size()), forces.cols());
  for (std::size_t g = 0; g < b.size(); ++g)
    for (std::uint32_t i = b.first[g]; i < b.first[g + 1]; ++i)
      of_points.middleRows<3>(3 * static_cast<Index>(i)) =
          b.weights[i] * forces.middleRows<3>(static_cast<Index>(3 * g));
  return kelvin_fields(X, b.points, b.s, of_points, poisson);
}

double modulus_weight(double k_x, double k_y) {
  return 2 / (k_x + k_y);
}

}  // namespace

ElasticKernel::ElasticKernel(ElasticBody body, std::unique_ptr<const Remainder> remainder)
    : body_(std::move(body)), remainder_(std::move(remainder)) {}

PointGroups ElasticKernel::groups(std::span<const Vec3> positions, std::span<const double> cores) const {
  NeedleRings rings;
  rings.build(positions, cores, body_.needle_radius);
  return rings.groups(positions.size());
}

MatrixXd ElasticKernel::between(const PointGroups& a, const PointGroups& b) const {
  const Pieces of_a(a, body_);
  std::optional<Pieces> other;
  if (&a != &b) other.emplace(b, body_);
  const Pieces& of_b = other ? *other : of_a;  // one object twice costs the remainder half
  MatrixXd near = kelvin_between(of_a.pieces, of_b.pieces, body_.poisson);
  Remainder::Parts parts;
  if (remainder_) {
    parts = remainder_->between(of_a.pieces, of_b.pieces);
    near -= parts.held;
  }
  MatrixXd C = MatrixXd::Zero(static_cast<Index>(3 * a.size()), static_cast<Index>(3 * b.size()));
  for (std::size_t j = 0; j < of_b.group.size(); ++j)
    for (std::size_t i = 0; i < of_a.group.size(); ++i) {
      const auto row = static_cast<Index>(3 * i), column = static_cast<Index>(3 * j);
      const double w = modulus_weight(of_a.moduli[of_a.modulus[i]], of_b.moduli[of_b.modulus[j]]);
      auto sum = C.block<3, 3>(3 * of_a.group[i], 3 * of_b.group[j]);
      sum += w * near.block<3, 3>(row, column);
      if (parts.motion.size() > 0) sum += parts.motion.block<3, 3>(row, column);
    }
  return C / body_.shear_modulus;
}

MatrixXd ElasticKernel::fields(std::span<const Vec3> X, const PointGroups& b, const MatrixXd& forces) const {
  const Pieces of_b(b, body_);
  const auto rows = static_cast<Index>(3 * X.size());
  // One set of forces for each modulus, since their weights at X differ.
  const Index sets = forces.cols();
  MatrixXd of_moduli = MatrixXd::Zero(static_cast<Index>(3 * of_b.group.size()),
                                      sets * static_cast<Index>(of_b.moduli.size()));
  for (std::size_t j = 0; j < of_b.group.size(); ++j)
    of_moduli.block(static_cast<Index>(3 * j), sets * static_cast<Index>(of_b.modulus[j]), 3, sets) =
        forces.middleRows<3>(3 * of_b.group[j]);
  MatrixXd near = fields_of_groups(X, of_b.pieces, of_moduli, body_.poisson);
  Remainder::Parts parts;
  if (remainder_) {
    parts = remainder_->fields(X, of_b.pieces, of_moduli);
    near -= parts.held;
  }
  MatrixXd u = MatrixXd::Zero(rows, sets);
  for (std::size_t i = 0; i < X.size(); ++i) {
    const double k = body_.relative_modulus(X[i]);
    for (std::size_t m = 0; m < of_b.moduli.size(); ++m)
      u.middleRows<3>(static_cast<Index>(3 * i)) +=
          modulus_weight(k, of_b.moduli[m]) *
          near.block(static_cast<Index>(3 * i), sets * static_cast<Index>(m), 3, sets);
  }
  for (Index m = 0; m < parts.motion.cols(); m += sets) u += parts.motion.middleCols(m, sets);
  return u / body_.shear_modulus;
}

MatrixXd ElasticKernel::smooth_fields(std::span<const Vec3> X, double modulus, const PointGroups& b,
                                      const MatrixXd& forces) const {
  const Index sets = forces.cols();
  if (!remainder_) return MatrixXd::Zero(static_cast<Index>(3 * X.size()), sets);
  const Pieces of_b(b, body_);
  MatrixXd twice(static_cast<Index>(3 * of_b.group.size()), 2 * sets);  // weighted for Q, as they are for P
  for (std::size_t j = 0; j < of_b.group.size(); ++j) {
    const auto force = forces.middleRows<3>(3 * of_b.group[j]);
    const double w = modulus_weight(modulus, of_b.moduli[of_b.modulus[j]]);
    twice.middleRows<3>(static_cast<Index>(3 * j)) << w * force, force;
  }
  const Remainder::Parts parts = remainder_->fields(X, of_b.pieces, twice);
  MatrixXd u = -parts.held.leftCols(sets);
  if (parts.motion.size() > 0) u += parts.motion.rightCols(sets);
  return u / body_.shear_modulus;
}

std::size_t ElasticKernel::bytes() const {
  return remainder_ ? remainder_->bytes() : 0;
}

}  // namespace brachy
