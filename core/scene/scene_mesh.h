#pragma once

#include <string>

#include "core/geometry/mesh_io/mesh_file.h"
#include "core/scene/scene.h"

namespace brachy {

/// Reads one of the scene's mesh files, `file` relative to it: gland, structure or region alike. All of them are in the
/// scene's tissue.units and tissue.frame; a file that states its own frame ("SPACE=LPS", as 3D Slicer writes) is in
/// that. The mesh is in mm, RAS. Errors: UserError as read_mesh_file.
SurfaceMesh read_scene_mesh(const Scene& scene, const std::string& file);

}  // namespace brachy
