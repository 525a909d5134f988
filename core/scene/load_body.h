#pragma once

#include "core/elastic/elastic_body.h"
#include "core/scene/scene.h"

namespace brachy {

/// The scene's box, moduli, regions and needle as the elastic rungs take them (N/mm², mm). Reads the meshes of regions.
/// Errors: UserError where a region's file cannot be used or a region leaves the box.
ElasticBody load_body(const Scene& scene);

}  // namespace brachy
