#pragma once

#include <string>
#include <vector>

#include "core/brachytherapy/structures/structure.h"
#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

/// Where a structure lies.
struct StructurePlace {
  std::string name;  ///< as its file has it
  StructureRole role = StructureRole::kOther;
  double volume_cc = 0;
  Vec3 centroid = Vec3::Zero(), min = Vec3::Zero(), max = Vec3::Zero();  ///< of the enclosed volume; mm, RAS
  std::string side;  ///< "posterior of the prostate by 18 mm", from centroid to centroid; empty for the gland
};

/// Of all structures, in their order. Preconditions: closed meshes, the first is the gland.
std::vector<StructurePlace> structure_places(const std::vector<Structure>& structures);

/// What contradicts human anatomy in a supine patient's frame (RAS), one line each, the likely cause with it: a rectum
/// that is not posterior of the gland, a bladder or seminal vesicles that are not superior, a penile bulb that is not
/// inferior, a pubic arch that is not anterior, a urethra outside the gland, an organ on the other side than its name
/// says, volumes beyond those of people, and structures that reach out of `image` (null: there is none) by more than a
/// voxel. None of these says that the geometry is right.
/// Bounds of volumes: wider than what is seen in patients; prostate 5 to 350 cm³ (volumes of 10 to 300 cm³ are
/// reported), bladder to 1.5 l. Preconditions: closed meshes, the first is the gland. Threads: any. Not real-time.
std::vector<std::string> anatomy_warnings(const std::vector<Structure>& structures,
                                          const VoxelGrid* image = nullptr);

/// Whether most of an implant's seeds, at `seeds` (mm, RAS), lie 10 mm or more outside the gland's bounding box, as
/// they do where their file has another frame, unit or patient: one line; empty: no, or there are no seeds. Single
/// seeds may lie far away: they migrate. Preconditions: as above.
std::string implant_warning(const std::vector<Structure>& structures, const std::vector<Vec3>& seeds);

}  // namespace brachy
