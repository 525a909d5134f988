#pragma once

#include "core/geometry/label_map/label_nrrd.h"

namespace brachy {

/// Of each file that is imported, and of each image or dose grid in one.
inline constexpr std::size_t kMostFileBytes = kLabelLimits.max_bytes, kMostVoxels = kLabelLimits.max_values;

}  // namespace brachy
