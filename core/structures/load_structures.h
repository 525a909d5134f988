#pragma once

#include <string_view>
#include <vector>

#include "core/scene/scene.h"
#include "core/structures/structure.h"

namespace brachy {

/// What dose is reported for: first "prostate", the tissue's own surface; then the phantom's "urethra" and "rectum",
/// stretched with tissue.phantom_size_mm, where the scene has no mesh; then each [[structure]], in the file's order.
/// A [[structure]] called as one of the phantom's takes its place. All closed, outward, mm, world frame. Errors:
/// UserError where a mesh cannot be read or is not closed. Not real-time.
std::vector<Structure> load_structures(const Scene& scene);

/// The structure of that name, or null.
const Structure* find_structure(const std::vector<Structure>& structures, std::string_view name);

}  // namespace brachy
