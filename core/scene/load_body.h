#pragma once

#include <memory>

#include "core/elasticity/elastic_body.h"
#include "core/scene/scene.h"

namespace brachy {

/// The scene's box, moduli, regions and needle for the elastic models (N/mm², mm). Reads the meshes of regions.
/// Omits regions without a modulus, which are like the tissue around them.
/// Errors: UserError where a region's file cannot be used or a region leaves the box.
ElasticBody load_body(const Scene& scene);

/// A region's shape, with its modulus, or that of the tissue around it. Errors: UserError where its file cannot be
/// used.
std::shared_ptr<const Region> load_region(const Scene& scene, const RegionSettings& settings);

/// The surface of a region of shape "mesh", closed and outward. Errors: UserError where its file cannot be used.
SurfaceMesh load_region_mesh(const Scene& scene, const RegionSettings& settings);

}  // namespace brachy
