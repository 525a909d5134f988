#pragma once

#include "core/elastic/elastic_body.h"
#include "core/scene/scene.h"

namespace brachy {

/// The scene's box, moduli, regions and needle as the elastic rungs take them (N/mm², mm). Reads the meshes of regions.
/// Regions without a modulus are as the tissue around them and left out.
/// Errors: UserError where a region's file cannot be used or a region leaves the box.
ElasticBody load_body(const Scene& scene);

/// The surface of a region of shape "mesh", closed and outward. Errors: UserError where its file cannot be used.
SurfaceMesh load_region_mesh(const Scene& scene, const RegionSettings& settings);

}  // namespace brachy
