#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/surface/surface_bvh.h"

namespace brachy {

/// Upper limit of interior points; a larger count is treated as a mistake.
constexpr std::size_t kMaxInteriorPoints = 20'000'000;

/// Exactly `count` points (mm) that fill the enclosed volume evenly: the R3 sequence of the generalised golden ratio
/// (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018) over the bounding box, shifted by
/// the seed (Cranley, Patterson 1976), those inside kept. The sequence runs in 64-bit integers, so that the
/// points are the same on every machine.
/// Errors: UserError where the count is above kMaxInteriorPoints, or fewer than one in a thousand of the box's
/// points lie inside. `name` is the surface's, for the message.
std::vector<Vec3> fill_interior(const SurfaceBvh& surface, std::size_t count, std::uint64_t seed,
                                const std::string& name = "the surface");

}  // namespace brachy
