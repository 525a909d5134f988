#pragma once

#include "core/contact/needle_tissues.h"
#include "core/scene/scene.h"

namespace brachy {

/// What the scene's needle meets where: [tissue], and every region that has needle forces of its own. Reads the meshes of
/// regions.
/// Errors: UserError where a region's file cannot be used.
NeedleTissues load_needle_tissues(const Scene& scene);

}  // namespace brachy
