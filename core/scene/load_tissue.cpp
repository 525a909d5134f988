#include "core/scene/load_tissue.h"

#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/tissue/interior_points.h"
#include "core/geometry/tissue/phantom.h"
#include "core/scene/scene_mesh.h"

namespace brachy {
namespace {

std::string surface_name(const Scene& scene) {
  return scene.tissue.mesh.empty() ? "the phantom" : scene.resolve(scene.tissue.mesh).string();
}

}  // namespace

PreparedSurface load_surface(const Scene& scene) {
  const TissueSettings& s = scene.tissue;
  if (s.mesh.empty()) {
    SurfaceMesh phantom = prostate_phantom(s.phantom_surface_vertices);
    for (Vec3& v : phantom.vertices) v = v.cwiseProduct(s.phantom_size_mm.cwiseQuotient(phantom_size()));
    return prepare_surface(std::move(phantom), {}, surface_name(scene));
  }
  return prepare_surface(read_scene_mesh(scene, s.mesh), {s.weld_tolerance_mm, s.min_island_share},
                         surface_name(scene));
}

LoadedTissue load_tissue(const Scene& scene) {
  const std::string name = surface_name(scene);
  PreparedSurface prepared = load_surface(scene);
  require_closed(prepared.report, name);
  const std::size_t surface_count = prepared.mesh.vertices.size(), total = scene.tissue.points;
  const SurfaceBvh surface(prepared.mesh);
  const std::size_t interior_count = total > surface_count ? total - surface_count : 0;
  const auto interior = fill_interior(surface, interior_count, scene.tissue.seed, name);
  return {build_tissue(prepared.mesh, interior), prepared.report};
}

}  // namespace brachy
