#include "core/ladder/elastic_kernel.h"

#include "core/ladder/kelvin.h"
#include "core/ladder/needle_rings.h"

namespace brachy {
namespace {

using Eigen::Index;

// Groups restricted to one material: their points' weights times the share of it at the point.
PointGroups of_material(const PointGroups& groups, const ElasticBody& body, std::size_t material, bool& any) {
  PointGroups part;
  std::vector<double> shares(body.regions.size() + 1);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    part.begin_group();
    for (std::uint32_t i = groups.first[g]; i < groups.first[g + 1]; ++i) {
      body.material_shares(groups.points[i], shares);
      if (shares[material] == 0) continue;
      part.add(groups.points[i], groups.s[i], groups.weights[i] * shares[material]);
      any = true;
    }
  }
  part.finish();
  return part;
}

// The same split once for all materials; those without a point are left out.
struct Split {
  Split(const PointGroups& groups, const ElasticBody& body) {
    for (std::size_t m = 0; m <= body.regions.size(); ++m) {
      bool any = false;
      PointGroups part = of_material(groups, body, m, any);
      if (!any) continue;
      parts.push_back(std::move(part));
      materials.push_back(m);
    }
  }
  std::vector<PointGroups> parts;
  std::vector<std::size_t> materials;
};

Eigen::MatrixXd kelvin_between(const PointGroups& a, const PointGroups& b, double poisson) {
  Eigen::MatrixXd G =
      Eigen::MatrixXd::Zero(static_cast<Index>(3 * a.size()), static_cast<Index>(3 * b.size()));
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) {
      Mat3 sum = Mat3::Zero();
      for (std::uint32_t p = a.first[i]; p < a.first[i + 1]; ++p)
        for (std::uint32_t q = b.first[j]; q < b.first[j + 1]; ++q)
          sum += a.weights[p] * b.weights[q] * kelvin(a.points[p] - b.points[q], a.s[p] + b.s[q], poisson);
      G.block<3, 3>(static_cast<Index>(3 * i), static_cast<Index>(3 * j)) = sum;
    }
  return G;
}

// G f at points X: 3|X| × m.
Eigen::MatrixXd kelvin_fields(std::span<const Vec3> X, const PointGroups& b, const Eigen::MatrixXd& forces,
                              double poisson) {
  Eigen::MatrixXd u = Eigen::MatrixXd::Zero(static_cast<Index>(3 * X.size()), forces.cols());
  for (std::size_t i = 0; i < X.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) {
      Mat3 sum = Mat3::Zero();
      for (std::uint32_t q = b.first[j]; q < b.first[j + 1]; ++q)
        sum += b.weights[q] * kelvin(X[i] - b.points[q], b.s[q], poisson);
      u.middleRows<3>(static_cast<Index>(3 * i)).noalias() +=
          sum * forces.middleRows<3>(static_cast<Index>(3 * j));
    }
  return u;
}

double modulus_weight(double k_x, double k_y) {
  return 2 / (k_x + k_y);
}

}  // namespace

ElasticKernel::ElasticKernel(ElasticBody body, std::unique_ptr<const Remainder> remainder)
    : body_(std::move(body)), remainder_(std::move(remainder)), materials_(body_.materials()) {}

PointGroups ElasticKernel::groups(std::span<const Vec3> positions, std::span<const double> cores) const {
  NeedleRings rings;
  rings.build(positions, cores, body_.needle_radius);
  return rings.groups(positions.size());
}

Eigen::MatrixXd ElasticKernel::between(const PointGroups& a, const PointGroups& b) const {
  const Split of_a(a, body_), of_b(b, body_);
  Eigen::MatrixXd C =
      Eigen::MatrixXd::Zero(static_cast<Index>(3 * a.size()), static_cast<Index>(3 * b.size()));
  for (std::size_t i = 0; i < of_a.parts.size(); ++i)
    for (std::size_t j = 0; j < of_b.parts.size(); ++j) {
      const double w = modulus_weight(materials_[of_a.materials[i]], materials_[of_b.materials[j]]);
      C += w * kelvin_between(of_a.parts[i], of_b.parts[j], body_.poisson);
      if (!remainder_) continue;
      const Remainder::Parts parts = remainder_->between(of_a.parts[i], of_b.parts[j]);
      C -= w * parts.held;
      if (parts.motion.size() > 0) C += parts.motion;
    }
  return C / body_.shear_modulus;
}

Eigen::MatrixXd ElasticKernel::fields(std::span<const Vec3> X, const PointGroups& b,
                                      const Eigen::MatrixXd& forces) const {
  const Split of_b(b, body_);
  Eigen::MatrixXd u = Eigen::MatrixXd::Zero(static_cast<Index>(3 * X.size()), forces.cols());
  std::vector<double> shares(materials_.size()), weights(X.size());
  for (std::size_t j = 0; j < of_b.parts.size(); ++j) {
    for (std::size_t i = 0; i < X.size(); ++i) {
      body_.material_shares(X[i], shares);
      weights[i] = 0;
      for (std::size_t m = 0; m < shares.size(); ++m)
        weights[i] += shares[m] * modulus_weight(materials_[m], materials_[of_b.materials[j]]);
    }
    Eigen::MatrixXd near = kelvin_fields(X, of_b.parts[j], forces, body_.poisson);
    Remainder::Parts parts;
    if (remainder_) {
      parts = remainder_->fields(X, of_b.parts[j], forces);
      near -= parts.held;
    }
    for (std::size_t i = 0; i < X.size(); ++i) near.middleRows<3>(static_cast<Index>(3 * i)) *= weights[i];
    u += near;
    if (parts.motion.size() > 0) u += parts.motion;
  }
  return u / body_.shear_modulus;
}

Eigen::MatrixXd ElasticKernel::smooth_fields(std::span<const Vec3> X, std::size_t main, const PointGroups& b,
                                             const Eigen::MatrixXd& forces) const {
  Eigen::MatrixXd u = Eigen::MatrixXd::Zero(static_cast<Index>(3 * X.size()), forces.cols());
  if (!remainder_) return u;
  const Split of_b(b, body_);
  for (std::size_t j = 0; j < of_b.parts.size(); ++j) {
    const Remainder::Parts parts = remainder_->fields(X, of_b.parts[j], forces);
    u -= modulus_weight(materials_[main], materials_[of_b.materials[j]]) * parts.held;
    if (parts.motion.size() > 0) u += parts.motion;
  }
  return u / body_.shear_modulus;
}

double ElasticKernel::near_weight(std::size_t main, const Vec3& Y) const {
  std::vector<double> shares(materials_.size());
  body_.material_shares(Y, shares);
  double w = 0;
  for (std::size_t m = 0; m < shares.size(); ++m)
    w += shares[m] * modulus_weight(materials_[main], materials_[m]);
  return w;
}

std::size_t ElasticKernel::bytes() const {
  return remainder_ ? remainder_->bytes() : 0;
}

}  // namespace brachy
