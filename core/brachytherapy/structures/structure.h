#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/structures/structure_role.h"
#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// A part of the patient that dose is reported for.
struct Structure {
  /// "prostate", "urethra", "rectum", "bladder", "pubic_arch" of what has that role (structure_role.h), whatever its
  /// file calls it; of others what the scene calls them.
  std::string name;
  SurfaceMesh mesh;  ///< closed, outward, at rest; mm, world frame W
  StructureRole role = StructureRole::kOther;
  std::string label = {};  ///< what the scene calls it, where that is another name

  const std::string& shown_name() const { return label.empty() ? name : label; }  ///< as files have it
};

/// The structure of that name or, where there is none, that label; or null.
const Structure* find_structure(const std::vector<Structure>& structures, std::string_view name);

}  // namespace brachy
