#pragma once

#include <span>

#include "core/base/rigid_transform.h"

namespace brachy {

/// How far a field of displacements is from its reference.
struct FieldError {
  double rel_l2 = 0;  ///< |u − u_ref| / |u_ref|
  double max_mm = 0;  ///< largest |u − u_ref| at a point
};

/// `u`: at the reference's points, in their order, and maybe at more after them.
FieldError field_error(std::span<const Vec3> u, std::span<const Vec3> reference);

}  // namespace brachy
