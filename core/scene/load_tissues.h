#pragma once

#include <string_view>

#include "core/elastic/elastic_body.h"
#include "core/heterogeneous/tissue_kernels.h"
#include "core/scene/scene.h"

namespace brachy {

/// Whether `rung` meets tissues of different supports in this scene: regions have a support_radius_mm and the rung is one
/// that takes it (ψ or compact).
/// Errors: UserError naming the region that has not what the rung needs: a support_radius_mm where another region has one;
/// a shear_modulus_kpa for elastic and fem.
bool has_supports(const Scene& scene, std::string_view rung);

/// The scene's tissues for a ψ kernel whose support is `support_mm` in no region. Regions of one support are one tissue.
/// Reads the meshes of regions.
/// Errors: UserError where a region's file cannot be used or there are more than Membership::kMaxTissues.
TissueModel<ScalarKernels> load_scalar_tissues(const Scene& scene, Kernel psi, double support_mm);

/// The same for a compact rung fitted to `body`: in a region the wall of the fit is its support_radius_mm, and the modulus,
/// which forces are proportional to, its own if it has one. Regions of one wall and one modulus are one tissue.
TissueModel<CompactKernels> load_compact_tissues(const Scene& scene, CompactRung rung,
                                                 const ElasticBody& body);

}  // namespace brachy
