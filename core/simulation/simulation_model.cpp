#include "core/simulation/simulation_model.h"

#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/elasticity/landmark_stiffness.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/matrix_kernel/smooth_tables.h"

namespace brachy {
namespace {

SurfaceMesh surface_of(const Tissue& tissue) {
  const auto begin = tissue.rest_vertices.begin();
  return {{begin, begin + static_cast<std::ptrdiff_t>(tissue.surface_count)}, tissue.triangles};
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
                                 std::optional<Plan> seed_plan)
    : tissue(std::move(tissue_at_rest)),
      surface(surface_of(tissue)),
      deformation(std::move(deformation_model)),
      needle_tissues(std::move(tissues_of_needle)),
      settings(s),
      plan(std::move(seed_plan)),
      anchors(make_anchors(tissue, s.anchors, models_support(deformation))) {
  if (const auto* matrix = std::get_if<MatrixModel>(&deformation)) {
    require_in_box(tissue, matrix->body);
    smooth_tables = make_smooth_tables(tissue, *matrix->kernel, settings.target);
  }
}

std::size_t SimulationModel::max_landmarks() const {
  return settings.needle.count * static_cast<std::size_t>(settings.contact.max_landmarks) +
         settings.anchors.count;
}

std::optional<double> SimulationModel::guide_z_mm() const {
  if (settings.needle.guide_at != "template") return {};
  return settings.template_grid.origin_mm.z();
}

double SimulationModel::landmark_stiffness_n_per_mm() const {
  return elastic_landmark_stiffness(1e-3 * settings.shear_modulus_kpa, settings.poisson,
                                    settings.contact.inserted_tip_core_mm());
}

}  // namespace brachy
