#pragma once

#include <cstdint>
#include <filesystem>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// The unit of a mesh file's coordinates; the file itself does not state it.
enum class MeshUnits { kMm, kM };

/// The patient frame of a mesh file's coordinates. LPS (DICOM, ITK, 3D Slicer's default export) has x and y
/// reversed against RAS.
enum class MeshFrame { kRas, kLps };

struct MeshFileOptions {
  MeshUnits units = MeshUnits::kMm;
  MeshFrame frame = MeshFrame::kRas;
  std::uintmax_t max_bytes = std::uintmax_t{512} << 20;  ///< larger files are refused without reading them
};

/// Reads the triangles of an .stl, .obj or .ply file (any case) into mm, RAS. A file whose header or comments say
/// "SPACE=LPS" or "SPACE=RAS", as 3D Slicer writes them, is in that frame, whatever `options` say. A byte order mark, a
/// text STL in capitals and filling bytes behind an STL's last triangle are as without them. Polygons are
/// triangulated, points and lines dropped. Neither welded nor oriented: see prepare_surface. The order of vertices is
/// unspecified (the reader may merge, split or reorder them), and coordinates have single precision. Two kinds of
/// truncation cannot be detected: an .obj cut off within its faces (the surface is then open, which require_closed
/// refuses), and a last text number cut short. Opens no other file: an .obj's mtllib is ignored. Errors: UserError,
/// one line, for anything missing, empty, oversized, truncated, malformed or not finite. Threads: any, independent
/// calls. Not real-time.
SurfaceMesh read_mesh_file(const std::filesystem::path& path, const MeshFileOptions& options = {});

}  // namespace brachy
