#include "core/models/matrix_kernel/near_bounds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "core/elasticity/kelvin.h"

namespace brachy {
namespace {

constexpr int kBins = 256, kPerBin = 4, kAngles = 8;
constexpr double kBetweenSamples = 1.1;  // more than these smooth functions grow between two samples
constexpr double kStep = 1e-2;           // mm, of second differences

double nuclear_norm(const Mat3& A) {
  Eigen::SelfAdjointEigenSolver<Mat3> solver;
  solver.computeDirect(A.transpose() * A, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().cwiseMax(0).cwiseSqrt().sum();
}

double squeeze_of(const Mat3& A) {
  Eigen::SelfAdjointEigenSolver<Mat3> solver;
  solver.computeDirect(0.5 * (A + A.transpose()), Eigen::EigenvaluesOnly);
  return solver.eigenvalues().cwiseAbs().maxCoeff();  // of f and of −f
}

// Over directions of the force; the three second derivatives of a frame are each at most the greatest over directions.
template <class Gradient>
NearBounds::At sample(const Gradient& gradient, double distance) {
  constexpr double kDiagonal = std::numbers::sqrt2 / 2;
  static const Vec3 directions[] = {{1, 0, 0},
                                    {0, 1, 0},
                                    {0, 0, 1},
                                    {kDiagonal, kDiagonal, 0},
                                    {kDiagonal, -kDiagonal, 0},
                                    {kDiagonal, 0, kDiagonal},
                                    {0, kDiagonal, kDiagonal}};
  const Vec3 x(std::max(distance, 1e-6), 0, 0);
  NearBounds::At largest;
  for (int i = 0; i <= kAngles; ++i) {
    const double angle = 0.5 * std::numbers::pi * i / kAngles;
    const Vec3 f(std::cos(angle), std::sin(angle), 0);
    const Mat3 A = gradient(x, f);
    largest.slope = std::max(largest.slope, kBetweenSamples * nuclear_norm(A));
    largest.squeeze = std::max(largest.squeeze, kBetweenSamples * squeeze_of(A));
    for (const Vec3& e : directions) {
      const Mat3 second = (gradient(x + kStep * e, f) - 2 * A + gradient(x - kStep * e, f)) / (kStep * kStep);
      largest.curvature = std::max(largest.curvature, kBetweenSamples * 3 * nuclear_norm(second));
    }
  }
  return largest;
}

}  // namespace

// With u = φ f + χ x (x·f) and P = φ′/r, Q = χ, S = χ′/r (near_loops.cpp) ∇u's symmetric part is
// ½(P + Q)(f xᵀ + x fᵀ) + (x·f)(Q I + S x xᵀ): P + Q = −[(1 − 2b) + 1.5 s/r²]/r³, and the second has the eigenvalues
// (x·f) b/r³, twice, and down to −2 (x·f) b/r³ along x. Its trace is −(1 − 2b)(x·f)(1 + 1.5 s/r²)/r³.
// ∇(G f) scales as 1/(r² + s) times a function of r²/s alone, its second derivatives as 1/(r² + s)².
NearBounds::NearBounds(double poisson) {
  const double b = 1 / (4 * (1 - poisson));
  kelvin_shrink_ = (1 - 2 * b) / (4 * std::numbers::pi);
  kelvin_stretch_ = b / (4 * std::numbers::pi);
  const auto gradient = [&](const Vec3& x, const Vec3& f) { return kelvin_gradient(x, 1, poisson, f); };
  const auto of_correction = [&](const Vec3& x, const Vec3& f) {
    return Mat3(kelvin_gradient(x, 1, poisson, f) - kelvin_gradient(x, 4, poisson, f));
  };
  double steepest = 0;
  for (double distance = 0; distance < 20; distance = 1.02 * distance + 0.02) {
    const At here = sample(gradient, distance);
    const double r2 = distance * distance + 1;
    kelvin_.slope = std::max(kelvin_.slope, here.slope * r2);
    kelvin_.squeeze = std::max(kelvin_.squeeze, here.squeeze * r2);
    kelvin_.curvature = std::max(kelvin_.curvature, here.curvature * r2 * r2);
    const At pair = sample(of_correction, distance);
    correction_.slope = std::max(correction_.slope, pair.slope * r2 * r2);
    correction_.squeeze = std::max(correction_.squeeze, pair.squeeze * r2 * r2);
    correction_.curvature = std::max(correction_.curvature, pair.curvature * r2 * r2 * r2);
    if (here.slope <= steepest) continue;
    steepest = here.slope;
    steepest_ = distance;
  }
}

KelvinBounds NearBounds::kelvin() const {
  const auto single = [](double x) { return static_cast<float>(x); };
  return {single(kelvin_.slope),       single(kelvin_.squeeze),      single(kelvin_.curvature),
          single(kelvin_shrink_),      single(kelvin_stretch_),      single(correction_.slope),
          single(correction_.squeeze), single(correction_.curvature)};
}

NearBounds::NearBounds(const CompactKernel& kernel, double scale)
    : bins_per_mm_(kBins / kernel.support()), bounds_(kBins + 1) {
  const auto gradient = [&](const Vec3& x, const Vec3& f) { return Mat3(scale * kernel.gradient(x, f)); };
  double steepest = 0;
  for (std::size_t k = kBins; k-- > 0;) {
    bounds_[k] = bounds_[k + 1];
    for (int i = 0; i <= kPerBin; ++i) {
      const double distance = (static_cast<double>(k) + static_cast<double>(i) / kPerBin) / bins_per_mm_;
      const At here = sample(gradient, distance);
      bounds_[k].slope = std::max(bounds_[k].slope, here.slope);
      bounds_[k].squeeze = std::max(bounds_[k].squeeze, here.squeeze);
      bounds_[k].curvature = std::max(bounds_[k].curvature, here.curvature);
      if (here.slope <= steepest) continue;
      steepest = here.slope;
      steepest_ = distance;
    }
  }
}

}  // namespace brachy
