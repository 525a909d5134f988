#include "apps/lab/stability/landmark_systems.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "apps/lab/comparators/global_spline.h"
#include "core/elasticity/elastic_kernel.h"

namespace brachy {
namespace {

constexpr std::size_t kShaft = 24, kNeedle = 9;
constexpr double kCore = 2.5;  // mm, the example of core/DESIGN.md, section 4

double uniform(std::mt19937& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
}

std::vector<Vec3> scaled(std::vector<Vec3> points, double factor, const Vec3& middle = Vec3::Zero()) {
  for (Vec3& p : points) p = middle + factor * p;
  return points;
}

/// Caches results: several sweeps use the same values, and a matrix of fem takes a tenth of a second.
SystemFamily::Matrix remembering(const SystemFamily::Matrix& matrix) {
  const auto known = std::make_shared<std::map<double, std::optional<Eigen::MatrixXd>>>();
  return [=](double value) {
    const auto found = known->find(value);
    return found != known->end() ? found->second : known->emplace(value, matrix(value)).first->second;
  };
}

void add_psi(std::vector<SystemFamily>& families, const std::string& name, double EigenvalueLaw::*constant,
             std::vector<Vec3> points) {
  const double q = least_spacing(points), n = static_cast<double>(points.size());
  for_each_kernel([&](auto kernel) {
    const EigenvalueLaw law = kernel.kEigenvalueLaw;
    SystemFamily family{
        .method = std::string(kernel.kName), .landmarks = name, .parameter = "a/q", .from = 4, .to = 1e6};
    family.matrix = [=](double a_over_q) { return psi_matrix(kernel, a_over_q * q, points); };
    family.condition_by_theory = [=](double a_over_q) {
      return n / law.least_eigenvalue(law.*constant, a_over_q);
    };
    families.push_back(std::move(family));
  });
}

SystemFamily needle_of(const std::string& model_name, const MatrixKernel& kernel, const Vec3& middle) {
  SystemFamily family{
      .method = model_name, .landmarks = "shaft of 9", .parameter = "spacing, mm", .from = 5, .to = 1e-3};
  family.matrix = remembering([&kernel, middle](double spacing) {
    const PointGroups groups = kernel.groups(scaled(unit_shaft(kNeedle), spacing, middle), {});
    return std::optional(kernel.between(groups, groups));
  });
  return family;
}

SystemFamily spline_of(const std::string& name, const SplineBasis& basis, const ElasticBody& body) {
  SystemFamily family{.method = name,
                      .landmarks = "shaft of 9, walls held",
                      .parameter = "spacing, mm",
                      .from = 5,
                      .to = 1e-3,
                      .is_definite = false};
  family.matrix = remembering([basis, body](double spacing) -> std::optional<Eigen::MatrixXd> {
    std::vector<Vec3> positions = scaled(unit_shaft(kNeedle), spacing, body.box_centre);
    for (const Vec3& wall : wall_points(body)) positions.push_back(wall);
    try {
      return SplineMap(basis, positions, kNeedle).matrix();
    } catch (const std::runtime_error&) {
      return std::nullopt;
    }
  });
  return family;
}

}  // namespace

std::vector<Vec3> unit_shaft(std::size_t n) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < n; ++i) points.emplace_back(0, 0, static_cast<double>(i));
  return points;
}

std::vector<Vec3> unit_grid(std::size_t per_side) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < per_side * per_side * per_side; ++i)
    points.emplace_back(i % per_side, i / per_side % per_side, i / (per_side * per_side));
  return points;
}

std::vector<Vec3> jittered_grid(std::size_t per_side) {
  std::mt19937 random(1);
  std::vector<Vec3> points = unit_grid(per_side);
  for (Vec3& p : points)
    for (double& x : p) x += uniform(random, -0.2, 0.2);
  return points;
}

double least_spacing(const std::vector<Vec3>& points) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) least = std::min(least, (points[i] - points[j]).norm());
  return least;
}

Eigen::MatrixXd psi_matrix(const Kernel& kernel, double support, const std::vector<Vec3>& positions) {
  const auto n = static_cast<Eigen::Index>(positions.size());
  Eigen::MatrixXd K(n, n);
  std::visit(
      [&](auto psi) {
        for (Eigen::Index i = 0; i < n; ++i)
          for (Eigen::Index j = 0; j <= i; ++j) {
            const Vec3 x = positions[static_cast<std::size_t>(i)] - positions[static_cast<std::size_t>(j)];
            K(i, j) = K(j, i) = psi.value(x.norm() / support);
          }
      },
      kernel);
  return K;
}

Spectrum spectrum(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(symmetric, Eigen::EigenvaluesOnly);
  const Eigen::VectorXd sizes = eigen.eigenvalues().cwiseAbs();
  return {sizes.minCoeff(), sizes.maxCoeff()};
}

template <class Scalar>
Solved solve_in(const Eigen::MatrixXd& matrix, bool is_definite) {
  // The engine takes the symmetric part (MatrixKernelSystem): fem's kernel is not quite symmetric
  // (fem_remainder.h), and misses by that.
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  std::mt19937 random(2);
  Eigen::VectorXd d(matrix.rows());
  for (double& x : d) x = uniform(random, -5, 5);
  const Matrix K = (0.5 * (matrix + matrix.transpose())).cast<Scalar>();
  const Vector rhs = d.cast<Scalar>();
  Vector weights;
  if (is_definite) {
    const Eigen::LLT<Matrix> factor(K);
    if (factor.info() != Eigen::Success) return {false, std::numeric_limits<double>::infinity()};
    weights = factor.solve(rhs);
  } else {
    weights = K.partialPivLu().solve(rhs);
  }
  const double missed = (matrix * weights.template cast<double>() - d).template lpNorm<Eigen::Infinity>();
  return {std::isfinite(missed), missed};
}
template Solved solve_in<float>(const Eigen::MatrixXd&, bool);
template Solved solve_in<double>(const Eigen::MatrixXd&, bool);

std::vector<SystemFamily> system_families(StabilityScene& scene) {
  std::vector<SystemFamily> families;
  add_psi(families, "shaft of 24", &EigenvalueLaw::on_shaft, unit_shaft(kShaft));
  add_psi(families, "jittered grid of 125", &EigenvalueLaw::on_jittered_grid, jittered_grid(5));
  for (const std::string& model_name : scene.models())
    if (!scene.is_quick() || model_name != "fem")
      families.push_back(needle_of(model_name, scene.kernel(model_name), scene.middle()));
  families.push_back(core_line(scene.body(), kNeedle));
  families.push_back(spline_of("thin_plate", SplineBasis::thin_plate(), scene.body()));
  families.push_back(
      spline_of("multiquadric", SplineBasis::multiquadric(scene.body().needle_radius), scene.body()));
  return families;
}

SystemFamily core_line(const ElasticBody& body, std::size_t n) {
  SystemFamily family{.method = "elastic",
                      .landmarks = "line of " + std::to_string(n) + " points with cores",
                      .parameter = "spacing/core",
                      .from = 2,
                      .to = 1e-2};
  const auto kernel = std::make_shared<ElasticKernel>(body, nullptr);
  family.matrix = [kernel, n](double spacing) {
    const std::vector<double> cores(n, kCore);
    const PointGroups groups = kernel->groups(scaled(unit_shaft(n), kCore * spacing), cores);
    return std::optional(kernel->between(groups, groups));
  };
  return family;
}

std::optional<double> first_failure(double from, double to, const std::function<bool(double)>& fails,
                                    double within) {
  constexpr double kFactor = 1.3;
  if (fails(from)) return from;
  const bool rises = to > from;
  double good = from, bad = from;
  do {
    if (bad == to) return std::nullopt;
    good = bad;
    bad = rises ? std::min(to, bad * kFactor) : std::max(to, bad / kFactor);
  } while (!fails(bad));
  while (std::abs(bad - good) > within * good) {
    const double middle = std::sqrt(good * bad);
    (fails(middle) ? bad : good) = middle;
  }
  return bad;
}

}  // namespace brachy
