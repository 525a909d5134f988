#include "core/scene/scene_mesh.h"

namespace brachy {

SurfaceMesh read_scene_mesh(const Scene& scene, const std::string& file) {
  MeshFileOptions options;
  options.units = scene.tissue.units == "m" ? MeshUnits::kM : MeshUnits::kMm;
  options.frame = scene.tissue.frame == "LPS" ? MeshFrame::kLps : MeshFrame::kRas;
  return read_mesh_file(scene.resolve(file), options);
}

}  // namespace brachy
