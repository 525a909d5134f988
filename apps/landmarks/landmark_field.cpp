#include "apps/landmarks/landmark_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <variant>

#include "apps/landmarks/landmark_file.h"
#include "apps/landmarks/refusal.h"
#include "core/base/error.h"
#include "core/base/number_csv.h"
#include "core/elasticity/compact/compact_kernel.h"
#include "core/elasticity/elastic_kernel.h"
#include "core/models/blended/blended_kernel_system.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/scene/choice/choice.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_body.h"
#include "core/scene/load_tissues.h"
#include "core/solve/per_landmark_support.h"
#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"

namespace brachy {
namespace {

constexpr double kWall = 48;  // mm: largest support of a compact model without a scene

void require_finite(std::span<const Vec3> weights, const std::string& name) {
  for (const Vec3& w : weights)
    if (!w.allFinite()) throw Refused(name + ": the weights overflow; are the displacements in mm?");
}

ElasticBody body_of(const std::string& model_name, const std::optional<Scene>& scene,
                    const LandmarkFieldOptions& options) {
  ElasticBody body = scene ? load_body(*scene) : ElasticBody{};
  if (options.poisson) body.poisson = *options.poisson;
  if (options.shear_modulus_kpa) body.shear_modulus = 1e-3 * *options.shear_modulus_kpa;
  if (scene || model_name == "elastic") return body;
  if (model_name == "fem") throw UserError("--kernel fem meshes a body: give one with --scene FILE");
  if (!options.core_radius_mm)
    throw UserError("--kernel " + model_name +
                    " is fitted to a needle: give --scene FILE or --core-radius MM");
  body.needle_radius = *options.core_radius_mm / kCompactCore;
  body.box_size = Vec3::Constant(2 * options.support_mm.value_or(kWall));
  return body;
}

std::unique_ptr<MatrixKernel> kernel_of(const std::string& model_name, bool has_scene,
                                        const ElasticBody& body) {
  if (!has_scene && model_name == "elastic")
    return std::make_unique<ElasticKernel>(body, nullptr);  // unbounded
  return make_matrix_kernel(model_name, body);
}

/// The least core radius of the landmarks and a needle's, mm; refused where a landmark `needs_one` and has none.
double least_core(const Landmarks& landmarks, double needle_radius, bool needs_one, const std::string& name) {
  double least = needle_radius;
  for (std::size_t i = 0; i < landmarks.cores.size(); ++i) {
    const double core = landmarks.cores[i];
    if (core > 0) least = std::min(least, core);
    if (core == 0 && needs_one)
      refuse_line(name, landmarks.lines[i],
                  "no core radius; give --core-radius MM, a column core_mm, or --scene FILE with a needle");
  }
  return least;
}

}  // namespace

struct LandmarkField::Impl {
  std::string name, model_name;
  Landmarks landmarks;
  std::vector<Vec3> weights;
  double condition = 1;

  // Of a ψ kernel, of one with supports of the landmarks' own, or of a model in tissues of different supports: u at a
  // point …
  std::variant<RbfField, PerLandmarkSystem, HeterogeneousField<ScalarKernels>,
               HeterogeneousField<CompactKernels>>
      at_point;
  std::variant<std::monostate, TissueModel<ScalarKernels>, TissueModel<CompactKernels>> tissues;
  std::vector<double> shares;
  // … or of a matrix model.
  std::unique_ptr<MatrixKernel> kernel;
  std::unique_ptr<MatrixKernelSystem> system;

  void solve_scalar(double support);
  void solve_by_paper();
  template <class Kernels>
  void solve_tissues(TissueModel<Kernels> model);
  void solve_matrix();
};

void LandmarkField::Impl::solve_scalar(double support) {
  const Kernel psi = *find_kernel(model_name);
  merge_duplicates(landmarks, FactorStatus::kDuplicateDistance * support, name);
  RbfSystem rows(psi, support, static_cast<int>(landmarks.positions.size()));
  FactorStatus status = rows.factorize(landmarks.positions);
  condition = rows.condition();
  if (status) status = FactorStatus::of_condition(condition);
  if (!status)
    throw Refused(
        fmt::format("{}: {}; change --support, use psi30, or thin them out", name,
                    explain_refusal(status, landmarks.positions, landmarks.displacements, psi, support)));
  weights.resize(landmarks.positions.size());
  rows.solve(landmarks.displacements, weights);
  at_point = RbfField{psi, support, landmarks.positions, weights};
}

void LandmarkField::Impl::solve_by_paper() {
  const double least = *std::ranges::min_element(landmarks.supports);
  merge_duplicates(landmarks, FactorStatus::kDuplicateDistance * least, name);
  auto& by_paper = at_point.emplace<PerLandmarkSystem>(*find_kernel(model_name));
  const FactorStatus status = by_paper.factorize(landmarks.positions, landmarks.supports);
  condition = by_paper.condition();
  if (!status)
    throw Refused(fmt::format(
        "{}: with one support per landmark the system is {}: its condition number is {:.3g}, above {:g}; "
        "such a matrix need not be regular: use one --support for all, or change a support by some percent",
        name, std::isfinite(condition) ? "nearly singular" : "singular", condition,
        FactorStatus::kMaxCondition));
  weights.resize(landmarks.positions.size());
  by_paper.solve(landmarks.displacements, weights);
}

template <class Kernels>
void LandmarkField::Impl::solve_tissues(TissueModel<Kernels> model) {
  const auto& kept = tissues.emplace<TissueModel<Kernels>>(std::move(model));
  merge_duplicates(landmarks, FactorStatus::kDuplicateDistance * kept.largest_support(), name);
  BlendedKernelSystem<Kernels> rows(kept, landmarks.positions.size());
  const FactorStatus status = rows.factorize(landmarks.positions);
  condition = rows.condition();
  if (!status) {
    const auto condition_of = [&](std::span<const std::size_t> chosen) {
      std::vector<Vec3> positions;
      for (const std::size_t i : chosen) positions.push_back(landmarks.positions[i]);
      BlendedKernelSystem<Kernels> tried(kept, positions.size());
      tried.factorize(positions);
      return tried.condition();
    };
    throw Refused(fmt::format("{}: {}; lower region.support_radius_mm, or thin them out", name,
                              explain_refusal(status, landmarks.positions, model_name, condition_of)));
  }
  weights.resize(landmarks.positions.size());
  rows.solve(landmarks.displacements, weights);
  shares.assign(rows.shares().begin(), rows.shares().end());
  at_point = HeterogeneousField<Kernels>{&kept, landmarks.positions, shares, weights};
}

void LandmarkField::Impl::solve_matrix() {
  system = std::make_unique<MatrixKernelSystem>(*kernel);
  const FactorStatus status = system->factorize(landmarks.positions, landmarks.cores);
  condition = system->condition();
  if (!status) {
    const auto condition_of = [&](std::span<const std::size_t> chosen) {
      std::vector<Vec3> positions;
      std::vector<double> cores;
      for (const std::size_t i : chosen) {
        positions.push_back(landmarks.positions[i]);
        cores.push_back(landmarks.cores[i]);
      }
      MatrixKernelSystem tried(*kernel);
      tried.factorize(positions, cores);
      return tried.condition();
    };
    throw Refused(fmt::format("{}: {}; keep them 0.8 core radii apart, or thin them out", name,
                              explain_refusal(status, landmarks.positions, model_name, condition_of)));
  }
  weights = system->solve(landmarks.displacements);
}

LandmarkField::LandmarkField(const LandmarkFieldOptions& options) : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.name = options.landmarks.string();
  std::optional<Scene> scene;
  if (options.scene) {
    std::string choice;
    scene = with_choice(load_scene(*options.scene), &choice);
    if (!choice.empty() && options.kernel.empty()) std::cerr << "brachy: " << choice << "\n";
  }
  m.model_name = !options.kernel.empty() ? options.kernel : scene ? scene->model.kernel : "psi31";
  m.landmarks = load_landmarks(options);
  const bool heterogeneous = scene && has_supports(*scene, m.model_name);
  if (is_matrix_model(m.model_name)) {
    if (!m.landmarks.supports.empty())
      throw UserError(m.name + ": the column support is for a psi kernel; remove it, or use --kernel psi31");
    const ElasticBody body = body_of(m.model_name, scene, options);
    if (heterogeneous) {
      m.solve_tissues(load_compact_tissues(*scene, body));
    } else {
      m.kernel = kernel_of(m.model_name, scene.has_value(), body);
      const double least =
          least_core(m.landmarks, body.needle_radius, !scene && m.model_name == "elastic", m.name);
      merge_duplicates(m.landmarks, FactorStatus::kDuplicateDistance * least, m.name);
      m.solve_matrix();
    }
  } else if (!m.landmarks.supports.empty()) {
    m.solve_by_paper();
  } else {
    if (!options.support_mm && !scene)
      throw UserError("--kernel " + m.model_name +
                      " needs --support MM, its support radius, a column support, or --scene FILE");
    const double support = options.support_mm ? *options.support_mm : scene->model.support_radius_mm;
    if (heterogeneous)
      m.solve_tissues(load_scalar_tissues(*scene, *find_kernel(m.model_name), support));
    else
      m.solve_scalar(support);
  }
  require_finite(m.weights, m.name);
}

LandmarkField::~LandmarkField() = default;

std::vector<Vec3> LandmarkField::displacements(std::span<const Vec3> X) const {
  if (impl_->system) return impl_->system->evaluate(X, impl_->weights);
  std::vector<Vec3> u;
  u.reserve(X.size());
  for (const Vec3& x : X)
    u.push_back(std::visit([&](const auto& field) { return Vec3(field.displacement(x)); }, impl_->at_point));
  return u;
}

std::vector<double> LandmarkField::jacobians(std::span<const Vec3> X) const {
  if (impl_->system) return impl_->system->jacobians(X, impl_->weights);
  std::vector<double> det;
  det.reserve(X.size());
  for (const Vec3& x : X)
    det.push_back(std::visit([&](const auto& field) { return field.deformation_gradient(x).determinant(); },
                             impl_->at_point));
  return det;
}

std::size_t LandmarkField::landmarks() const {
  return impl_->landmarks.positions.size();
}
double LandmarkField::condition() const {
  return impl_->condition;
}
const std::string& LandmarkField::kernel() const {
  return impl_->model_name;
}

std::optional<Vec3> LandmarkField::total_force() const {
  if (!is_matrix_model(impl_->model_name)) return std::nullopt;
  Vec3 sum = Vec3::Zero();
  for (const Vec3& f : impl_->weights) sum += f;
  return sum;
}

}  // namespace brachy
