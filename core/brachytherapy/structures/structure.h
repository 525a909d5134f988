#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// A part of the patient that dose is reported for: "prostate", "urethra", "rectum" or what the scene calls it.
struct Structure {
  std::string name;
  SurfaceMesh mesh;  ///< closed, outward, at rest; mm, world frame W
};

/// The structure of that name, or null.
const Structure* find_structure(const std::vector<Structure>& structures, std::string_view name);

}  // namespace brachy
