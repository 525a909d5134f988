#include "core/simulation/simulation_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/elasticity/landmark_stiffness.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "core/models/matrix_kernel/smooth_tables.h"
#include "core/simulation/model_digest.h"

namespace brachy {
namespace {

SurfaceMesh surface_of(const Tissue& tissue) {
  const auto begin = tissue.rest_vertices.begin();
  return {{begin, begin + static_cast<std::ptrdiff_t>(tissue.surface_count)}, tissue.triangles};
}

// By how much the model's walls let the gland go as a whole: of points of its surface that are moved together by each
// of the six modes in turn, about its apex.
Vec6 held_compliance(const Tissue& tissue, const DeformationModel& deformation) {
  const auto* matrix = std::get_if<MatrixModel>(&deformation);
  if (!matrix)
    throw UserError("gland.moves needs a model that knows forces; set model.kernel to elastic or fem");
  constexpr std::size_t kPoints = 80;
  std::vector<Vec3> positions;
  Vec3 centre = Vec3::Zero();
  for (std::size_t i = 0; i < tissue.surface_count; ++i)
    centre += tissue.rest_vertices[i] / static_cast<double>(tissue.surface_count);
  const std::size_t stride = std::max<std::size_t>(1, tissue.surface_count / kPoints);
  for (std::size_t i = 0; i < tissue.surface_count; i += stride) positions.push_back(tissue.rest_vertices[i]);
  MatrixKernelSystem system(*matrix->kernel);
  double area = 0;  // as of a sphere
  for (const Vec3& p : positions)
    area += 4 * std::numbers::pi * (p - centre).squaredNorm() / static_cast<double>(positions.size());
  const std::vector<double> cores(positions.size(),
                                  0.5 * std::sqrt(area / static_cast<double>(positions.size())));
  Vec6 held = Vec6::Zero();
  if (!system.factorize(positions, cores))
    throw UserError(
        "gland.moves: the walls' stiffness could not be found; make the surface's points more even");
  for (int mode = 0; mode < 6; ++mode) {
    const Vec6 motion = Vec6::Unit(mode);
    std::vector<Vec3> moved;
    for (const Vec3& p : positions) moved.push_back(LandmarkCompliance::moved_by(motion, p - centre));
    double work = 0;
    const std::vector<Vec3> forces = system.solve(moved);
    for (std::size_t i = 0; i < forces.size(); ++i) work += forces[i].dot(moved[i]);
    held[mode] = 1 / work;
  }
  return held;
}

bool models_support(const DeformationModel& deformation) {
  return std::holds_alternative<MatrixModel>(deformation) ||
         std::holds_alternative<TissueModel<CompactKernels>>(deformation);
}

}  // namespace

Anchors make_anchors(const Tissue& tissue, Anchors::Options options, bool models_support) {
  if (options.count > tissue.surface_count)
    throw UserError("anchors.count is " + std::to_string(options.count) + " but the surface has only " +
                    std::to_string(tissue.surface_count) + " vertices; lower anchors.count");
  if (models_support) options.count = 0;
  return {{tissue.rest_vertices.data(), tissue.surface_count}, options};
}

SimulationModel::SimulationModel(Tissue tissue_at_rest, DeformationModel deformation_model,
                                 NeedleTissues tissues_of_needle, const SimulationSettings& s,
                                 std::optional<Plan> seed_plan, std::vector<TestedOrgan> organs_at_risk,
                                 std::vector<Seed> seeds, const SetUp& set_up)
    : tissue(std::move(tissue_at_rest)),
      surface(surface_of(tissue)),
      deformation(std::move(deformation_model)),
      needle_tissues(std::move(tissues_of_needle)),
      settings(s),
      plan(std::move(seed_plan)),
      organs(std::move(organs_at_risk)),
      seeds_at_start(std::move(seeds)),
      body_at_rest(s.body.gland, s.body.swelling, apex_of(tissue),
                   s.body.gland.moves ? held_compliance(tissue, deformation) : Vec6(Vec6::Zero())),
      anchors(make_anchors(tissue, s.anchors, models_support(deformation))) {
  for (Seed& seed : seeds_at_start) seed.is_fixed = !surface.inside(seed.rest);
  if (const auto* matrix = std::get_if<MatrixModel>(&deformation)) {
    require_in_box(tissue, matrix->body);
    smooth_tables = make_smooth_tables(tissue, *matrix->kernel, settings.target, set_up);
  }
  digest = digest_of(*this);
}

std::size_t SimulationModel::max_landmarks() const {
  return settings.needle.count * static_cast<std::size_t>(settings.contact.max_landmarks) +
         settings.anchors.count + (settings.probe.on ? ProbeSettings::kMaxLandmarks : 0);
}

std::optional<double> SimulationModel::guide_z_mm() const {
  if (settings.needle.guide_at == "none") return {};
  return settings.template_grid.origin_mm.z();
}

Vec3 SimulationModel::apex_of(const Tissue& tissue) {
  Vec3 apex = Vec3::Constant(std::numeric_limits<double>::infinity()), sum = Vec3::Zero();
  for (std::size_t i = 0; i < tissue.surface_count; ++i) {
    apex = apex.cwiseMin(tissue.rest_vertices[i]);
    sum += tissue.rest_vertices[i];
  }
  sum /= static_cast<double>(tissue.surface_count);
  return {sum.x(), sum.y(), apex.z()};
}

double SimulationModel::landmark_stiffness_n_per_mm() const {
  return elastic_landmark_stiffness(1e-3 * settings.softness.shear_modulus_kpa, settings.softness.poisson,
                                    settings.contact.inserted_tip_core_mm());
}

}  // namespace brachy
