#pragma once

#include <cstdint>
#include <filesystem>

#include "core/surface/surface_mesh.h"

namespace brachy {

/// The unit a mesh file's numbers are in; the file itself does not say.
enum class MeshUnits { kMm, kM };

/// The patient frame a mesh file's numbers are in. LPS (DICOM, ITK, 3D Slicer's default export) has x and y
/// reversed against RAS.
enum class MeshFrame { kRas, kLps };

struct MeshFileOptions {
  MeshUnits units = MeshUnits::kMm;
  MeshFrame frame = MeshFrame::kRas;
  std::uintmax_t max_bytes = std::uintmax_t{512} << 20;  ///< larger files are refused unread
};

/// Reads the triangles of an .stl, .obj or .ply file (any case) into mm, RAS. Polygons are triangulated, points
/// and lines dropped. Not welded, not oriented: that is prepare_surface. Vertex order means nothing (the reader
/// may merge, split or reorder), and coordinates carry single precision.
/// Two readings cannot be told from a sound file: an .obj cut off within its faces (the surface is then open, which
/// require_closed refuses), and a last text number cut short.
/// Nothing but the named file is opened: an .obj's mtllib is not followed.
/// Errors: UserError, one line, for anything missing, empty, oversized, truncated, malformed or not finite.
/// Threads: any, independent calls. Not real-time.
SurfaceMesh read_mesh_file(const std::filesystem::path& path, const MeshFileOptions& options = {});

}  // namespace brachy
