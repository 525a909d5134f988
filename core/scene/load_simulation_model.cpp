#include "core/scene/load_simulation_model.h"

#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/scene/load_body.h"
#include "core/scene/load_needle_tissues.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_structures.h"
#include "core/scene/load_tissues.h"

namespace brachy {
namespace {

DeformationModel load_deformation_model(const Scene& scene, const Tissue& tissue) {
  const std::string& name = scene.model.kernel;
  const bool heterogeneous = has_supports(scene, name);
  if (!is_matrix_model(name)) {
    const Kernel psi = *find_kernel(name);
    if (heterogeneous) return load_scalar_tissues(scene, psi, scene.model.support_radius_mm);
    return ScalarModel{psi, scene.model.support_radius_mm};
  }
  ElasticBody body = load_body(scene);
  require_in_box(tissue, body);
  if (heterogeneous) return load_compact_tissues(scene, body);
  std::shared_ptr<const MatrixKernel> kernel = make_matrix_kernel(name, body, tissue.rest_vertices);
  return MatrixModel{std::move(kernel), std::move(body)};
}

}  // namespace

std::shared_ptr<const SimulationModel> load_simulation_model(const Scene& scene, Tissue tissue,
                                                             const SetUp& set_up) {
  if (scene.model.kernel == "auto")
    throw UserError("model.kernel is still \"auto\"; the scene has to go through with_choice first");
  if (scene.needle.flexible && !knows_forces(scene.model.kernel))
    throw UserError("needle.flexible needs a model that knows forces, and model.kernel is " +
                    scene.model.kernel + "; take elastic or fem");
  if (scene.probe.on && !knows_forces(scene.model.kernel))
    throw UserError("probe.on needs a model that knows forces, and model.kernel is " + scene.model.kernel +
                    "; take elastic or fem");
  SimulationSettings settings;
  settings.period_s = scene.period_s();
  settings.target = resolve_simd_target(scene.engine.simd);
  settings.threads = scene.engine.threads;
  settings.work.costs = scene.work_costs;
  settings.softness = {scene.tissue.shear_modulus_kpa, scene.tissue.poisson};
  settings.anchors = scene.anchors;
  settings.guard = scene.stability;
  settings.needle = scene.needle;
  settings.contact = scene.contact;
  settings.body = {scene.gland, scene.swelling};
  settings.probe = scene.probe;
  settings.noise = scene.noise;
  settings.template_grid = scene.template_grid;
  settings.seeds = scene.seeds;
  // A catheter carries no seeds: a press of the button finds no train.
  if (scene.implant.is_hdr()) settings.seeds.applicator = "train";
  if (const auto plan = load_hdr_plan(scene))  // refused at the start, where it is wrong
    for (const PlanCatheter& catheter : plan->catheters) settings.courses.push_back(catheter.course);
  NeedleTissues needle_tissues = load_needle_tissues(scene);
  DeformationModel deformation = load_deformation_model(scene, tissue);
  return std::make_shared<const SimulationModel>(
      std::move(tissue), std::move(deformation), std::move(needle_tissues), settings, load_plan(scene),
      tested_organs(load_structures(scene)), load_seeds_at_start(scene), set_up);
}

Anchors load_anchors(const Scene& scene, const Tissue& tissue) {
  return make_anchors(tissue, scene.anchors, is_matrix_model(scene.model.kernel));
}

}  // namespace brachy
