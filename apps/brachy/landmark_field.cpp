#include "apps/brachy/landmark_field.h"

#include <fmt/format.h>

#include <iostream>
#include <variant>

#include "core/choice/choice.h"
#include "core/compact/compact_kernel.h"
#include "core/elastic/elastic_kernel.h"
#include "core/error.h"
#include "core/heterogeneous/heterogeneous_system.h"
#include "core/ladder/ladder.h"
#include "core/ladder/ladder_system.h"
#include "core/number_csv.h"
#include "core/rbf/rbf_field.h"
#include "core/rbf/rbf_system.h"
#include "core/scene/load_body.h"
#include "core/scene/load_tissues.h"
#include "core/scene/scene_file.h"

namespace brachy {
namespace {

constexpr double kWall = 48;  // mm: largest support of a compact rung without a scene

struct Landmarks {
  std::vector<Vec3> positions, displacements;
  std::vector<double> cores;  // mm, 0: the rung's rule
  std::vector<std::size_t> lines;
};

Vec3 vec3(std::span<const double> row, std::size_t first) {
  return {row[first], row[first + 1], row[first + 2]};
}

Landmarks load_landmarks(const std::filesystem::path& file, double default_core) {
  const NumberTable table =
      load_number_csv(file, "x,y,z,dx,dy,dz", {.max_rows = 20'000, .optional_column = "core_mm"});
  Landmarks landmarks;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const std::span<const double> row = table.row(i);
    if (table.columns > 6 && row[6] < 0)
      refuse_line(file.string(), table.lines[i], "core_mm is negative; 0 takes the kernel's own rule");
    landmarks.positions.push_back(vec3(row, 0));
    landmarks.displacements.push_back(vec3(row, 3));
    landmarks.cores.push_back(table.columns > 6 && row[6] > 0 ? row[6] : default_core);
    landmarks.lines.push_back(table.lines[i]);
  }
  return landmarks;
}

/// Of landmarks that are one to the solver (nearer than `distance` mm), the later is dropped if both say the same;
/// otherwise they contradict.
void merge_duplicates(Landmarks& landmarks, double distance, const std::string& name) {
  Landmarks kept;
  for (std::size_t i = 0; i < landmarks.positions.size(); ++i) {
    bool merged = false;
    for (std::size_t j = 0; j < kept.positions.size() && !merged; ++j) {
      if ((kept.positions[j] - landmarks.positions[i]).norm() >= distance) continue;
      const double differ = (kept.displacements[j] - landmarks.displacements[i]).norm();
      if (differ > distance)
        throw Refused(
            fmt::format("{}:{}: contradicts line {}: the same place is displaced by {:g} mm more or less; "
                        "remove one of them",
                        name, landmarks.lines[i], kept.lines[j], differ));
      std::cerr << fmt::format("brachy: {}:{}: merged with line {}, which says the same\n", name,
                               landmarks.lines[i], kept.lines[j]);
      merged = true;
    }
    if (merged) continue;
    kept.positions.push_back(landmarks.positions[i]);
    kept.displacements.push_back(landmarks.displacements[i]);
    kept.cores.push_back(landmarks.cores[i]);
    kept.lines.push_back(landmarks.lines[i]);
  }
  landmarks = std::move(kept);
}

void require_finite(std::span<const Vec3> weights, const std::string& name) {
  for (const Vec3& w : weights)
    if (!w.allFinite()) throw Refused(name + ": the weights overflow; are the displacements in mm?");
}

ElasticBody body_of(const std::optional<Scene>& scene, const DeformOptions& options) {
  ElasticBody body = scene ? load_body(*scene) : ElasticBody{};
  if (options.poisson) body.poisson = *options.poisson;
  if (options.shear_modulus_kpa) body.shear_modulus = 1e-3 * *options.shear_modulus_kpa;
  return body;
}

std::unique_ptr<MatrixKernel> kernel_of(const std::string& rung, const std::optional<Scene>& scene,
                                        const DeformOptions& options) {
  ElasticBody body = body_of(scene, options);
  if (scene) return make_matrix_kernel(rung, body);
  if (rung == "fem") throw UserError("--kernel fem meshes a body: give one with --scene FILE");
  if (rung == "elastic") return std::make_unique<ElasticKernel>(body, nullptr);  // unbounded
  if (!options.core_radius_mm)
    throw UserError("--kernel " + rung + " is fitted to a needle: give --scene FILE or --core-radius MM");
  body.needle_radius = *options.core_radius_mm / kCompactCore;
  body.box_size = Vec3::Constant(2 * options.support_mm.value_or(kWall));
  return make_matrix_kernel(rung, body);
}

}  // namespace

struct LandmarkField::Impl {
  std::string name, rung;
  Landmarks landmarks;
  std::vector<Vec3> weights;

  // Of a ψ kernel, or of a rung in tissues of different supports: u at a point …
  std::variant<RbfField, HeterogeneousField<ScalarKernels>, HeterogeneousField<CompactKernels>> at_point;
  std::variant<std::monostate, TissueModel<ScalarKernels>, TissueModel<CompactKernels>> tissues;
  std::vector<double> shares;
  // … or of a matrix rung.
  std::unique_ptr<MatrixKernel> kernel;
  std::unique_ptr<LadderSystem> system;

  [[noreturn]] void refuse_singular(const std::string& at, const std::string& fix) const {
    throw Refused(name +
                  ": the landmark system is singular to rounding: landmarks lie too close together for " +
                  rung + at + "; " + fix + ", or thin them out");
  }

  void solve_scalar(double support) {
    merge_duplicates(landmarks, RbfSystem::kDuplicateDistance * support, name);
    const Kernel psi = *find_kernel(rung);
    RbfSystem rows(psi, support, static_cast<int>(landmarks.positions.size()));
    if (!rows.factorize(landmarks.positions))
      refuse_singular(fmt::format(" at --support {:g}", support), "lower --support, take psi30");
    weights.resize(landmarks.positions.size());
    rows.solve(landmarks.displacements, weights);
    at_point = RbfField{psi, support, landmarks.positions, weights};
  }

  template <class Kernels>
  void solve_tissues(TissueModel<Kernels> model) {
    const auto& kept = tissues.emplace<TissueModel<Kernels>>(std::move(model));
    merge_duplicates(landmarks, RbfSystem::kDuplicateDistance * kept.largest_support(), name);
    HeterogeneousSystem<Kernels> rows(kept, landmarks.positions.size());
    if (!rows.factorize(landmarks.positions))
      refuse_singular(" and the scene's supports", "lower region.support_radius_mm");
    weights.resize(landmarks.positions.size());
    rows.solve(landmarks.displacements, weights);
    shares.assign(rows.shares().begin(), rows.shares().end());
    at_point = HeterogeneousField<Kernels>{&kept, landmarks.positions, shares, weights};
  }

  void solve_matrix() {
    system = std::make_unique<LadderSystem>(*kernel);
    if (!system->factorize(landmarks.positions, landmarks.cores))
      refuse_singular("", "keep them 0.8 core radii apart");
    weights = system->solve(landmarks.displacements);
  }
};

LandmarkField::LandmarkField(const DeformOptions& options) : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.name = options.landmarks.string();
  std::optional<Scene> scene;
  if (options.scene) {
    std::string choice;
    scene = with_choice(load_scene(*options.scene), &choice);
    if (!choice.empty() && options.kernel.empty()) std::cerr << "brachy: " << choice << "\n";
  }
  m.rung = !options.kernel.empty() ? options.kernel : scene ? scene->model.kernel : "psi31";
  m.landmarks = load_landmarks(options.landmarks, options.core_radius_mm.value_or(0));
  const bool heterogeneous = scene && has_supports(*scene, m.rung);
  if (const auto compact = find_compact_rung(m.rung); compact && heterogeneous) {
    m.solve_tissues(load_compact_tissues(*scene, *compact, body_of(scene, options)));
  } else if (is_matrix_rung(m.rung)) {
    m.kernel = kernel_of(m.rung, scene, options);
    if (!scene && m.rung == "elastic")
      for (std::size_t i = 0; i < m.landmarks.cores.size(); ++i)
        if (m.landmarks.cores[i] == 0)
          refuse_line(
              m.name, m.landmarks.lines[i],
              "no core radius; give --core-radius MM, a column core_mm, or --scene FILE with a needle");
    merge_duplicates(m.landmarks, RbfSystem::kDuplicateDistance, m.name);
    m.solve_matrix();
  } else {
    if (!options.support_mm && !scene)
      throw UserError("--kernel " + m.rung + " needs --support MM, its support radius, or --scene FILE");
    const double support = options.support_mm ? *options.support_mm : scene->model.support_radius_mm;
    if (heterogeneous)
      m.solve_tissues(load_scalar_tissues(*scene, *find_kernel(m.rung), support));
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
    det.push_back(std::visit([&](const auto& field) { return field.jacobian(x); }, impl_->at_point));
  return det;
}

std::size_t LandmarkField::landmarks() const {
  return impl_->landmarks.positions.size();
}
const std::string& LandmarkField::kernel() const {
  return impl_->rung;
}

std::optional<Vec3> LandmarkField::total_force() const {
  if (!is_matrix_rung(impl_->rung)) return std::nullopt;
  Vec3 sum = Vec3::Zero();
  for (const Vec3& f : impl_->weights) sum += f;
  return sum;
}

}  // namespace brachy
