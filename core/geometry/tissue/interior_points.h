#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/surface/surface_bvh.h"

namespace brachy {

/// Upper limit of interior points; a larger count is treated as a mistake.
constexpr std::size_t kMaxInteriorPoints = 20'000'000;

/// Exactly `count` points (mm) that fill the enclosed volume evenly: EvenPlaces over the bounding box,
/// those inside kept; the same on every machine.
/// Errors: UserError where the count is above kMaxInteriorPoints, or fewer than one in a thousand of the box's
/// points lie inside. `name` is the surface's, for the message.
std::vector<Vec3> fill_interior(const SurfaceBvh& surface, std::size_t count, std::uint64_t seed,
                                const std::string& name = "the surface");

}  // namespace brachy
