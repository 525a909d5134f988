#pragma once

#include "core/base/rigid_transform.h"

namespace brachy::test {

/// I + ∇u at X of a field's displacement_at, by central differences.
template <class Field>
Mat3 deformation_gradient(const Field& field, const Vec3& X) {
  constexpr double kStep = 1e-4;  // mm
  Mat3 F = Mat3::Identity();
  for (int k = 0; k < 3; ++k)
    F.col(k) += (field.displacement_at(X + kStep * Vec3::Unit(k)) -
                 field.displacement_at(X - kStep * Vec3::Unit(k))) /
                (2 * kStep);
  return F;
}

}  // namespace brachy::test
