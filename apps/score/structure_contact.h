#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "apps/score/spread.h"
#include "core/brachytherapy/plan/template_grid.h"
#include "core/brachytherapy/structures/organ_pass_file.h"
#include "core/brachytherapy/structures/structure.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

/// What needles through one hole did to a structure that they should not meet.
struct StructureContact {
  std::string structure;  ///< "urethra"
  std::string hole;       ///< empty: beside the template
  /// How often a needle came into it from before: a tip that is in again, through a bend or on its way back, without
  /// having been drawn back by more than 1 mm behind where it entered, is in the same pass.
  std::uint32_t passes = 0;
  double depth_mm = 0;         ///< the tip's largest distance from the structure's surface, inside it
  double time_s = 0;           ///< with the tip in it
  double first_s = kNoNumber;  ///< when the first pass began
};

/// Each of `structures` against the tips of all needles, in the structures' order, then in that of the first entry;
/// those that no tip entered are left out. Structures are at rest: by how much the tissue had moved then is not in
/// the poses. A structure's bounding box is tried first.
std::vector<StructureContact> structure_contacts(std::span<const Structure> structures,
                                                 const TemplateGrid& grid, const NeedleTrajectories& poses);

/// The same of what the simulation saw in every tick, in the deformed tissue. A pass that had not ended when the
/// recording did has the depth and time that `poses`, if any, show against `structures` at rest.
std::vector<StructureContact> structure_contacts(std::span<const Structure> structures,
                                                 const TemplateGrid& grid, std::span<const OrganPass> passes,
                                                 const NeedleTrajectories* poses);

}  // namespace brachy
