#include "core/elasticity/compact/compact_kernel.h"

#include <algorithm>
#include <cassert>
#include <numbers>

#include "core/kernels/kernels.h"

namespace brachy {

CompactValue compact_value(const CompactTerm& term, double r) {
  const double t = r / term.support;
  if (!(t < 1)) return {};
  const double q = 1 - t, q4 = q * q * q * q;
  return {term.w * Wendland31::inside(t) + term.v * q4 * (1 + t * (4 - 20 * t)),
          term.v * q4 * 15 / (term.support * term.support)};
}

CompactKernel::CompactKernel(std::vector<CompactTerm> terms, double compliance)
    : terms_(std::move(terms)), compliance_(compliance) {
  std::erase_if(terms_, [](const CompactTerm& t) { return t.w <= 0 && t.v <= 0; });
  assert(!terms_.empty() && compliance > 0);
  for (const CompactTerm& t : terms_) support_ = std::max(support_, t.support);
}

CompactKernel CompactKernel::of_body(const ElasticBody& body, double* residual) {
  CompactFit fit =
      fit_compact(body.poisson, kCompactCore * body.needle_radius, 0.5 * body.box_size.minCoeff());
  if (residual) *residual = fit.residual;
  return {std::move(fit.terms), 1 / (4 * std::numbers::pi * body.shear_modulus)};
}

PointGroups CompactKernel::groups(std::span<const Vec3> positions, std::span<const double> /*cores*/) const {
  return PointGroups::single(positions, 0);
}

Mat3 CompactKernel::value(const Vec3& x) const {
  const double r2 = x.squaredNorm();
  if (r2 >= support_ * support_) return Mat3::Zero();
  const double r = std::sqrt(r2);
  CompactValue sum;
  for (const CompactTerm& t : terms_) {
    const CompactValue C = compact_value(t, r);
    sum.across += C.across;
    sum.outer += C.outer;
  }
  Mat3 C = compliance_ * sum.outer * (x * x.transpose());
  C.diagonal().array() += compliance_ * sum.across;
  return C;
}

// φ f + χ x (x·f): P = φ′/r, Q = χ, S = χ′/r (near_loops.cpp has the same in single precision).
Mat3 CompactKernel::gradient(const Vec3& x, const Vec3& f) const {
  const double r = x.norm(), dot = x.dot(f);
  double P = 0, Q = 0, S = 0;
  for (const CompactTerm& term : terms_) {
    const double t = r / term.support, inverse2 = 1 / (term.support * term.support);
    if (!(t < 1)) continue;
    const double q = 1 - t, q3 = q * q * q;
    P -= inverse2 * q3 * (20 * term.w + 60 * term.v * (1 - 2 * t));
    Q += 15 * inverse2 * term.v * q3 * q;
    S -= 60 * inverse2 * inverse2 * term.v * q3 / std::max(t, 1e-9);
  }
  Mat3 A = P * f * x.transpose() + Q * x * f.transpose() + S * dot * x * x.transpose();
  A.diagonal().array() += Q * dot;
  return compliance_ * A;
}

Eigen::MatrixXd CompactKernel::between(const PointGroups& a, const PointGroups& b) const {
  Eigen::MatrixXd K =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * a.size()), static_cast<Eigen::Index>(3 * b.size()));
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) {
      auto block = K.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j));
      for (std::size_t p = a.first[i]; p < a.first[i + 1]; ++p)
        for (std::size_t q = b.first[j]; q < b.first[j + 1]; ++q)
          block += a.weights[p] * b.weights[q] * value(a.points[p] - b.points[q]);
    }
  return K;
}

Eigen::MatrixXd CompactKernel::fields(std::span<const Vec3> X, const PointGroups& b,
                                      const Eigen::MatrixXd& forces) const {
  Eigen::MatrixXd u = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * X.size()), forces.cols());
  for (std::size_t i = 0; i < X.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      for (std::size_t q = b.first[j]; q < b.first[j + 1]; ++q) {
        const Vec3 x = X[i] - b.points[q];
        if (x.squaredNorm() >= support_ * support_) continue;
        u.middleRows<3>(static_cast<Eigen::Index>(3 * i)).noalias() +=
            b.weights[q] * value(x) * forces.middleRows<3>(static_cast<Eigen::Index>(3 * j));
      }
  return u;
}

}  // namespace brachy
