#include "apps/daemon/scene_message.h"

#include <algorithm>

#include "core/base/colour_text.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/hdr/dwell_doses.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/scene/load_plan.h"
#include "core/scene/structure_roles.h"

namespace brachy {
namespace {

/// Tissue that is more than the gland is no structure.
bool is_tissue_gland(const Scene& scene) {
  return std::ranges::count(structure_roles(scene), StructureRole::kGland) == 0;
}

std::vector<net::SceneColour> colours_of(const Scene& scene) {
  std::vector<net::SceneColour> colours;
  const auto add = [&](const std::string& name, const std::string& text) {
    if (const auto rgb = colour_from(text)) colours.push_back({name, (*rgb)[0], (*rgb)[1], (*rgb)[2]});
  };
  const std::vector<std::string> names = structure_names(scene);
  for (std::size_t n = 0; n < names.size(); ++n) add(names[n], scene.structures[n].colour);
  if (is_tissue_gland(scene)) add(role_word(StructureRole::kGland), scene.tissue.colour);
  return colours;
}

}  // namespace

net::SceneMessage make_scene_message(const Scene& scene, const std::optional<Plan>& plan,
                                     const std::vector<Structure>& structures) {
  net::SceneMessage message;
  message.needle_length_mm = scene.needle.length_mm;
  message.needle_diameter_mm = scene.needle.diameter_mm;
  message.seed_length_mm = kSeedLengthMm;
  message.seed_diameter_mm = kSeedDiameterMm;
  message.prescription_gy = plan ? plan->prescription_gy : scene.dose.prescription_gy;
  message.template_grid = scene.template_grid;
  const TemplateGrid on_wire = scene.template_grid.named_as_on_wire();
  if (plan) {
    for (std::size_t n = 0; n < plan->needles.size(); ++n)
      message.planned_needles.push_back({plan->planned_tip(scene.template_grid, n),
                                         on_wire.renamed(plan->needles[n].hole, scene.template_grid)});
    for (const PlannedSeed& seed : plan->seeds(scene.template_grid))
      message.planned_seeds.push_back({seed.position, seed.axis, static_cast<std::uint32_t>(seed.needle)});
  }
  // Of HDR the catheters, which leave no seed.
  if (const auto hdr = load_hdr_plan(scene))
    for (std::size_t c = 0; c < hdr->catheters.size(); ++c)
      message.planned_needles.push_back({hdr->planned_tip(scene.template_grid, c),
                                         hdr->catheters[c].has_course()
                                             ? hdr->catheters[c].name
                                             : on_wire.renamed(hdr->catheters[c].hole, scene.template_grid)});
  for (const Structure& structure : structures) {
    // The tissue itself is shown anyway.
    if (structure.name == role_word(StructureRole::kGland) && is_tissue_gland(scene)) continue;
    net::SceneStructure shown{structure.name, {}, structure.mesh.triangles};
    for (const Vec3& vertex : structure.mesh.vertices)
      for (int k = 0; k < 3; ++k) shown.vertices.push_back(static_cast<float>(vertex[k]));
    message.structures.push_back(std::move(shown));
  }
  message.kernels = all_model_names();
  if (scene.probe.on)
    message.probe = {.needle = static_cast<std::uint16_t>(scene.needle.count),
                     .diameter_mm = scene.probe.diameter_mm,
                     .length_mm = scene.probe.length_mm,
                     .rectal_wall_mm = scene.probe.rectal_wall_mm};
  const std::vector<DoseGoal> customary = scene.implant.is_hdr() ? hdr_dose_goals() : default_dose_goals();
  for (const DoseGoal& goal : scene.goals.empty() ? customary : scene.goals)
    message.goals.push_back({goal.structure, goal.figure, goal.limit_for(message.prescription_gy),
                             goal.is_above(), goal.is_of_plan(), goal.source});
  message.colours = colours_of(scene);
  return message;
}

}  // namespace brachy
