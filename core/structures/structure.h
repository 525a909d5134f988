#pragma once

#include <string>

#include "core/surface/surface_mesh.h"

namespace brachy {

/// A part of the patient that dose is reported for: "prostate", "urethra", "rectum" or what the scene calls it.
struct Structure {
  std::string name;
  SurfaceMesh mesh;  ///< closed, outward, at rest; mm, world frame W
};

}  // namespace brachy
