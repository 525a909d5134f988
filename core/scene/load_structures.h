#pragma once

#include <string>
#include <vector>

#include "core/brachytherapy/structures/structure.h"
#include "core/scene/scene.h"

namespace brachy {

/// The structures that dose is reported for: first "prostate", the [[structure]] with the gland's role, for a
/// body that is more than the gland, or else the tissue's own surface; then the phantom's "urethra"
/// and "rectum", stretched with tissue.phantom_size_mm, where the scene has no mesh; then each [[structure]], in the
/// file's order. A [[structure]] with the role of one of the phantom's replaces it. Those with a unique role have its
/// word for a name (structure_names). All closed, outward, mm, world frame.
/// Errors: UserError where a mesh cannot be read or is not closed, or roles are not clear. Not real-time.
std::vector<Structure> load_structures(const Scene& scene);

/// What contradicts human anatomy in the scene's `structures` and in the seeds that it has in the body at the start,
/// one line each (anatomy_warnings, implant_warning). The phantom's structures are as they should be. Errors: UserError
/// where implant.seeds cannot be read. Not real-time.
std::vector<std::string> geometry_warnings(const Scene& scene, const std::vector<Structure>& structures);

}  // namespace brachy
