#include "core/scene/load_body.h"

#include "core/base/error.h"
#include "core/geometry/surface/surface_check.h"
#include "core/scene/scene_mesh.h"

namespace brachy {
namespace {

constexpr double kPerKilopascal = 1e-3;  // N/mm²

void require_inside(const ElasticBody& body, const Region& region, std::size_t number) {
  for (const SurfacePatch& patch : region.surface(200))
    if (((patch.position - body.box_centre).cwiseAbs() - 0.5 * body.box_size).maxCoeff() > 0)
      throw UserError("[[region]] " + std::to_string(number) +
                      " reaches out of [box]; raise box.size_mm or move box.centre_mm");
}

}  // namespace

std::shared_ptr<const Region> load_region(const Scene& scene, const RegionSettings& s) {
  const double modulus = kPerKilopascal * s.shear_modulus_kpa.value_or(scene.tissue.shear_modulus_kpa);
  if (s.shape == "mesh") return std::make_shared<MeshRegion>(load_region_mesh(scene, s), modulus);
  return std::make_shared<EllipsoidRegion>(s.centre_mm, s.semi_axes_mm, modulus);
}

SurfaceMesh load_region_mesh(const Scene& scene, const RegionSettings& settings) {
  const std::string name = scene.resolve(settings.file).string();
  PreparedSurface prepared = prepare_surface(read_scene_mesh(scene, settings.file), {}, name);
  require_closed(prepared.report, name);
  return std::move(prepared.mesh);
}

ElasticBody load_body(const Scene& scene) {
  ElasticBody body;
  body.box_centre = scene.box.centre_mm;
  body.box_size = scene.box.size_mm;
  body.held = scene.box.held;
  body.shear_modulus = kPerKilopascal * scene.tissue.shear_modulus_kpa;
  body.poisson = scene.tissue.poisson;
  body.needle_radius = 0.5 * scene.needle.diameter_mm;
  for (std::size_t r = 0; r < scene.regions.size(); ++r) {
    if (!scene.regions[r].shear_modulus_kpa) continue;
    body.regions.push_back(load_region(scene, scene.regions[r]));
    require_inside(body, *body.regions.back(), r + 1);
  }
  return body;
}

}  // namespace brachy
