#pragma once

#include <optional>
#include <string_view>

#include "core/base/rigid_transform.h"

namespace brachy {

/// A rigid transform from 12 or 16 numbers with spaces or commas between, row by row (the last row 0 0 0 1), as people
/// write matrices into settings. The rotation is made exact: it may be off by 1e-3. nullopt: it is none.
std::optional<RigidTransform> rigid_transform_from(std::string_view text);

}  // namespace brachy
