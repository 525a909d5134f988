#pragma once

#include <string_view>

#include "core/elasticity/elastic_body.h"
#include "core/models/blended/tissue_kernels.h"
#include "core/scene/scene.h"

namespace brachy {

/// Whether the model has different supports in this scene: regions have a support_radius_mm, and the model uses it (ψ
/// or compact).
/// Errors: UserError naming the region that lacks a key which the model needs: support_radius_mm where another region
/// has one; shear_modulus_kpa for elastic and fem.
bool has_supports(const Scene& scene, std::string_view model_name);

/// The scene's tissues for a ψ kernel; its support outside of regions is `support_mm`. Regions of one support are one
/// tissue. Reads the meshes of regions.
/// Errors: UserError where a region's file cannot be used or there are more than Membership::kMaxTissues.
TissueModel<ScalarKernels> load_scalar_tissues(const Scene& scene, Kernel psi, double support_mm);

/// The same for compact_elastic fitted to `body`: in a region the wall of the fit is its support_radius_mm; the
/// modulus, which forces are proportional to, is its own if it has one. Regions of one wall and modulus are one tissue.
TissueModel<CompactKernels> load_compact_tissues(const Scene& scene, const ElasticBody& body);

}  // namespace brachy
