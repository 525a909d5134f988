#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// For each of `ours` its index in `given`: the same points, bit for bit, in another order.
std::vector<std::uint32_t> match_points(std::span<const Vec3> ours, std::span<const Vec3> given);

}  // namespace brachy
