#include "core/scene/load_structures.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "core/brachytherapy/structures/anatomy.h"
#include "core/brachytherapy/structures/phantom_structures.h"
#include "core/geometry/surface/surface_check.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_tissue.h"
#include "core/scene/scene_mesh.h"
#include "core/scene/structure_roles.h"

namespace brachy {
namespace {

SurfaceMesh closed(PreparedSurface prepared, const std::string& name) {
  require_closed(prepared.report, name);
  return std::move(prepared.mesh);
}

SurfaceMesh stretched(SurfaceMesh mesh, const Vec3& size_mm) {
  for (Vec3& v : mesh.vertices) v = v.cwiseProduct(size_mm.cwiseQuotient(phantom_size()));
  return mesh;
}

SurfaceMesh load(const Scene& scene, const StructureSettings& settings) {
  const std::string file = scene.resolve(settings.file).string();
  try {
    return closed(prepare_surface(read_scene_mesh(scene, settings.file), {}, file), file);
  } catch (const UserError& e) {
    throw UserError(settings.place + ": structure \"" + settings.name + "\": " + e.what());
  }
}

}  // namespace

std::vector<std::string> geometry_warnings(const Scene& scene, const std::vector<Structure>& structures) {
  std::vector<std::string> warnings;
  if (!scene.tissue.mesh.empty() || !scene.structures.empty()) warnings = anatomy_warnings(structures);
  std::string of_seeds = implant_warning(structures, middles_of(at_rest(load_seeds_at_start(scene))));
  if (!of_seeds.empty()) warnings.push_back(std::move(of_seeds));
  return warnings;
}

std::vector<Structure> load_structures(const Scene& scene) {
  const std::string tissue =
      scene.tissue.mesh.empty() ? "the phantom" : scene.resolve(scene.tissue.mesh).string();
  const std::vector<StructureRole> roles = structure_roles(scene);
  const std::vector<std::string> names = structure_names(scene);
  const auto load_own = [&](std::size_t n) {
    const std::string& label = scene.structures[n].name;
    return Structure{names[n], load(scene, scene.structures[n]), roles[n], label == names[n] ? "" : label};
  };
  const auto has_own = [&](StructureRole role) { return std::ranges::count(roles, role) > 0; };
  std::vector<Structure> all;
  using enum StructureRole;
  if (has_own(kGland))
    all.push_back(load_own(static_cast<std::size_t>(std::ranges::find(roles, kGland) - roles.begin())));
  else
    all.push_back({role_word(kGland), closed(load_surface(scene), tissue), kGland});
  if (scene.tissue.mesh.empty()) {
    const Vec3& size = scene.tissue.phantom_size_mm;
    if (!has_own(kUrethra))
      all.push_back({role_word(kUrethra), stretched(phantom_urethra(), size), kUrethra});
    if (!has_own(kRectum)) all.push_back({role_word(kRectum), stretched(phantom_rectum(), size), kRectum});
  }
  for (std::size_t n = 0; n < roles.size(); ++n)
    if (roles[n] != kGland) all.push_back(load_own(n));
  return all;
}

}  // namespace brachy
