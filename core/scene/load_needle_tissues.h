#pragma once

#include "core/needle/needle_tissues.h"
#include "core/scene/scene.h"

namespace brachy {

/// The needle forces at each place of the scene: those of [tissue], and of every region that has its own. Reads the
/// meshes of regions.
/// Errors: UserError where a region's file cannot be used.
NeedleTissues load_needle_tissues(const Scene& scene);

}  // namespace brachy
