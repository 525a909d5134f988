#pragma once

#include "core/scene/scene.h"
#include "core/surface/surface_check.h"
#include "core/tissue/tissue.h"

namespace brachy {

struct LoadedTissue {
  Tissue tissue;
  SurfaceReport report;  ///< what had to be done to the surface
};

/// The scene's tissue: its mesh file, or the phantom; welded, oriented, freed of islands, refused unless closed;
/// the interior filled up to tissue.points (a surface with more vertices than that has none inside).
/// Errors: UserError as the parts throw it. Not real-time.
LoadedTissue load_tissue(const Scene& scene);

/// The scene's surface before the check that it is closed: what `brachy inspect` reports.
PreparedSurface load_surface(const Scene& scene);

}  // namespace brachy
