#pragma once

#include <optional>
#include <string>

#include "core/geometry/volume/volume.h"
#include "core/scene/scene.h"
#include "net/http/dynamic_pages.h"

namespace brachy {

/// Most voxels of a volume that a viewer gets, of two bytes each.
inline constexpr std::size_t kMostShownVoxels = std::size_t{1} << 22;

/// The part of `volume` whose voxels' middles have indices within those of the corners of the box [least, most]
/// (mm, W), of whole voxels, coarsened to at most `most_voxels`. Nothing where they do not overlap.
std::optional<Volume> shown_part(const Volume& volume, const Vec3& least, const Vec3& most,
                                 std::size_t most_voxels = kMostShownVoxels);

/// A volume as NRRD with raw words of 16 bits, little-endian, in RAS: value = value_least + value_step · word, with
/// these two as key/value pairs, as are window_least and window_most, between which 98 % of the values lie.
std::string shown_text(const Volume& volume);

/// The page `/volume`: scene.display.volume about the scene's box, made once; where the scene names none, 204 No
/// Content. `margin_mm`: beyond the box.
/// Errors: UserError where the file is no NRRD volume, or has no voxel there.
net::DynamicPage volume_page(const Scene& scene, double margin_mm = 30);

}  // namespace brachy
