#include "core/scene/load_structures.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/brachytherapy/structures/phantom_structures.h"
#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_check.h"
#include "core/scene/load_tissue.h"

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
  const auto file = scene.resolve(settings.file);
  try {
    return closed(prepare_surface(read_mesh_file(file), {}, file.string()), file.string());
  } catch (const UserError& e) {
    throw UserError(settings.place + ": structure \"" + settings.name + "\": " + e.what());
  }
}

}  // namespace

std::vector<Structure> load_structures(const Scene& scene) {
  const std::string tissue =
      scene.tissue.mesh.empty() ? "the phantom" : scene.resolve(scene.tissue.mesh).string();
  const auto own = [&](const char* name) {
    return std::ranges::find(scene.structures, name, &StructureSettings::name);
  };
  const auto has_own = [&](const char* name) { return own(name) != scene.structures.end(); };
  std::vector<Structure> all;
  if (has_own("prostate"))
    all.push_back({"prostate", load(scene, *own("prostate"))});
  else
    all.push_back({"prostate", closed(load_surface(scene), tissue)});
  if (scene.tissue.mesh.empty()) {
    const Vec3& size = scene.tissue.phantom_size_mm;
    if (!has_own("urethra")) all.push_back({"urethra", stretched(phantom_urethra(), size)});
    if (!has_own("rectum")) all.push_back({"rectum", stretched(phantom_rectum(), size)});
  }
  for (const StructureSettings& settings : scene.structures)
    if (settings.name != "prostate") all.push_back({settings.name, load(scene, settings)});
  return all;
}

}  // namespace brachy
