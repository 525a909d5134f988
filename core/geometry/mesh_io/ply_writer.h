#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// A number for each vertex, e.g. {"det", …}: as many values as the mesh has vertices, or none to omit it.
struct PlyVertexProperty {
  std::string name;
  std::span<const double> values;
};

/// Writes an ASCII PLY: `property double x y z` with 17 significant digits, so that a reader of doubles gets the
/// same bits; the extra property if there is one; the triangles. Coordinates as given (mm, RAS in core).
/// Errors: UserError when the file cannot be opened or written (full disk); a partial file is removed.
void write_ply(const std::filesystem::path& path, const SurfaceMesh& mesh,
               const PlyVertexProperty& extra = {});

}  // namespace brachy
