#pragma once

#include "core/geometry/surface/surface_check.h"
#include "core/geometry/tissue/tissue.h"
#include "core/scene/scene.h"

namespace brachy {

struct LoadedTissue {
  Tissue tissue;
  SurfaceReport report;  ///< the changes that were made to the surface
};

/// The scene's tissue: its mesh file, or the phantom; welded, oriented, without islands, refused unless closed;
/// the interior filled up to tissue.points (none where the surface has more vertices than that).
/// Errors: UserError as the parts throw it. Not real-time.
LoadedTissue load_tissue(const Scene& scene);

/// The scene's surface before the check that it is closed: what `brachy inspect` reports.
PreparedSurface load_surface(const Scene& scene);

}  // namespace brachy
