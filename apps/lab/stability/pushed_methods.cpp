#include "apps/lab/stability/pushed_methods.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "apps/lab/comparators/chainmail.h"
#include "apps/lab/comparators/global_spline.h"
#include "apps/lab/comparators/mass_spring.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"

namespace brachy {
namespace {

/// Outside the shaft, whose inside is not tissue: there the models with a needle radius have a field between the points
/// of its rings.
DetSearch::Counts outside_shaft(const PushedLandmarks& landmarks, double radius) {
  if (landmarks.on_shaft < 2) return {};
  const Vec3 tip = landmarks.positions.front(), end = landmarks.positions[landmarks.on_shaft - 1];
  return [=](const Vec3& X) {
    const double along = std::clamp((X - tip).dot(end - tip) / (end - tip).squaredNorm(), 0.0, 1.0);
    return (X - tip - along * (end - tip)).norm() >= radius;
  };
}

PushedField search(Gradients gradients, const PushedLandmarks& landmarks, double scale,
                   DetSearch::Counts counts = {}) {
  return linear_field(std::move(gradients), samples_around(landmarks.positions, scale), scale / 12,
                      std::move(counts));
}

PushedMethod spline_method(std::string name, const SplineBasis& basis, const ElasticBody& body) {
  return {std::move(name), [=](const PushedLandmarks& landmarks) {
            std::vector<Vec3> positions = landmarks.positions;
            for (const Vec3& wall : wall_points(body)) positions.push_back(wall);
            const auto map = std::make_shared<SplineMap>(basis, positions, landmarks.positions.size());
            Eigen::Matrix<double, Eigen::Dynamic, 3> d(static_cast<Eigen::Index>(landmarks.directions.size()),
                                                       3);
            for (Eigen::Index i = 0; i < d.rows(); ++i)
              d.row(i) = landmarks.directions[static_cast<std::size_t>(i)].transpose();
            const auto u = [map, d](std::span<const Vec3> X) {
              const Eigen::MatrixXd rows = map->influence(X) * d;
              std::vector<Vec3> result(X.size());
              for (std::size_t i = 0; i < X.size(); ++i)
                result[i] = rows.row(static_cast<Eigen::Index>(i)).transpose();
              return result;
            };
            return search(gradients_by_differences(u), landmarks, 10);
          }};
}

/// The springs' rest position, which is linear in the push.
PushedField springs_at_rest(const PushedLandmarks& landmarks, const ElasticBody& body, double spacing) {
  const auto springs = std::make_shared<MassSpring>(spacing);
  springs->set_up({body, landmarks.positions, {}});
  const std::vector<Vec3> watched = samples_around(landmarks.positions, 3 * spacing, 300);
  std::vector<Vec3> before(watched.size(), Vec3::Zero());
  for (double moved = 1; moved > 1e-5;) {  // mm of the push's 1
    springs->tick(landmarks.directions);
    const std::vector<Vec3> u = springs->displacements_at(watched);
    moved = 0;
    for (std::size_t i = 0; i < u.size(); ++i) moved = std::max(moved, (u[i] - before[i]).norm());
    before = u;
  }
  const auto u = [springs](std::span<const Vec3> X) { return springs->displacements_at(X); };
  return search(gradients_by_differences(u), landmarks, 3 * spacing);
}

/// Slack links make the field nonlinear in the push, so that each push is computed separately. It folds where a chain
/// ends, at a wall, so every cell is checked.
PushedField chained(const PushedLandmarks& landmarks, const ElasticBody& body, double spacing) {
  const auto mail = std::make_shared<ChainMail>(spacing);
  mail->set_up({body, landmarks.positions, {}});
  std::vector<Vec3> samples = samples_around(landmarks.positions, 3 * spacing);
  const Vec3 cells = (body.box_size / spacing).array().round();
  for (const Vec3& cell : samples_around(std::vector{body.box_centre}, 0.5 * body.box_size.minCoeff(),
                                         static_cast<std::size_t>(cells.prod())))
    samples.push_back(cell);
  PushedField field;
  field.least_det = [=](double push) {
    std::vector<Vec3> d;
    for (const Vec3& direction : landmarks.directions) d.push_back(push * direction);
    mail->tick(d);
    const auto u = [mail](std::span<const Vec3> X) { return mail->displacements_at(X); };
    return DetSearch(gradients_by_differences(u), samples, spacing / 4).least(1).det;
  };
  field.fold = [least_det = field.least_det](double most) { return push_at_fold(least_det, most); };
  return field;
}

}  // namespace

PushedField linear_field(Gradients gradients, std::vector<Vec3> samples, double reach,
                         DetSearch::Counts counts) {
  if (!gradients) return {};
  const auto search =
      std::make_shared<DetSearch>(std::move(gradients), std::move(samples), reach, std::move(counts));
  return {[search](double push) { return search->least_known(push); },
          [search](double most) { return search->fold(most); }};
}

PushedLandmarks pushed_shaft(const Vec3& middle, std::size_t n, double spacing, const Vec3& direction) {
  PushedLandmarks shaft;
  for (std::size_t i = 0; i < n; ++i)
    shaft.add(middle + spacing * (0.5 * static_cast<double>(n - 1) - static_cast<double>(i)) * Vec3::UnitZ(),
              direction);
  shaft.on_shaft = n;
  return shaft;
}

Gradients psi_gradients(const Kernel& kernel, double support, const PushedLandmarks& landmarks) {
  const std::size_t n = landmarks.positions.size();
  RbfSystem system(kernel, support, static_cast<int>(n));
  if (!system.factorize(landmarks.positions)) return {};
  struct Owned {
    std::vector<Vec3> positions, weights;
  };
  const auto owned = std::make_shared<Owned>(Owned{landmarks.positions, std::vector<Vec3>(n)});
  system.solve(landmarks.directions, owned->weights);
  return [=](std::span<const Vec3> X) {
    const RbfField field{kernel, support, owned->positions, owned->weights};
    std::vector<Mat3> gradients;
    gradients.reserve(X.size());
    for (const Vec3& x : X) gradients.emplace_back(field.deformation_gradient(x) - Mat3::Identity());
    return gradients;
  };
}

Gradients matrix_gradients(const MatrixKernel& kernel, const PushedLandmarks& landmarks) {
  const auto system = std::make_shared<MatrixKernelSystem>(kernel);
  if (!system->factorize(landmarks.positions)) return {};
  const std::vector<Vec3> forces = system->solve(landmarks.directions);
  return gradients_by_differences([=](std::span<const Vec3> X) { return system->evaluate(X, forces); });
}

Gradients gradients_by_differences(std::function<std::vector<Vec3>(std::span<const Vec3>)> displacements) {
  return [displacements = std::move(displacements)](std::span<const Vec3> X) {
    constexpr double kHalf = 1e-3;  // mm
    std::vector<Vec3> around;
    around.reserve(6 * X.size());
    for (const Vec3& x : X)
      for (int k = 0; k < 3; ++k)
        for (const double step : {kHalf, -kHalf}) around.push_back(x + step * Vec3::Unit(k));
    const std::vector<Vec3> u = displacements(around);
    std::vector<Mat3> gradients(X.size());
    for (std::size_t i = 0; i < X.size(); ++i)
      for (int k = 0; k < 3; ++k) {
        const std::size_t at = 6 * i + 2 * static_cast<std::size_t>(k);
        gradients[i].col(k) = (u[at] - u[at + 1]) / (2 * kHalf);
      }
    return gradients;
  };
}

std::vector<PushedMethod> psi_methods(double support) {
  std::vector<PushedMethod> methods;
  for_each_kernel([&](auto kernel) {
    methods.push_back({std::string(kernel.kName), [=](const PushedLandmarks& landmarks) {
                         return search(psi_gradients(kernel, support, landmarks), landmarks, support);
                       }});
  });
  return methods;
}

std::vector<PushedMethod> other_methods(StabilityScene& scene) {
  constexpr double kLattice = 4;  // mm
  const ElasticBody& body = scene.body();
  std::vector<PushedMethod> methods;
  for (const std::string& model_name : scene.models())
    methods.push_back({model_name, [&scene, model_name](const PushedLandmarks& landmarks) {
                         const double radius = scene.body().needle_radius;
                         const bool has_needle_radius = model_name == "elastic" || model_name == "fem";
                         // Compact models vary over their supports, the least of which is a sixteenth of the largest.
                         const double scale = has_needle_radius ? 6 * radius : 12;
                         return search(
                             matrix_gradients(scene.kernel(model_name), landmarks), landmarks, scale,
                             has_needle_radius ? outside_shaft(landmarks, radius) : DetSearch::Counts{});
                       }});
  methods.push_back(spline_method("thin_plate", SplineBasis::thin_plate(), body));
  methods.push_back(spline_method("multiquadric", SplineBasis::multiquadric(body.needle_radius), body));
  methods.push_back({"mass_spring", [&body](const PushedLandmarks& landmarks) {
                       return springs_at_rest(landmarks, body, kLattice);
                     }});
  methods.push_back({"chainmail", [&body](const PushedLandmarks& landmarks) {
                       return chained(landmarks, body, kLattice);
                     }});
  return methods;
}

}  // namespace brachy
