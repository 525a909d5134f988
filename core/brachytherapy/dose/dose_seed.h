#pragma once

#include <cstdint>

#include "core/base/rigid_transform.h"

namespace brachy {

/// Which source a seed is; values go over the wire: append only.
enum class SourceModel : std::uint16_t {
  kAmersham6711 = 1,  ///< I-125, Amersham/GE OncoSeed 6711; "6711"
  kTheraSeed200 = 2,  ///< Pd-103, Theragenics TheraSeed 200; "200"
};

/// A seed as a source of dose: position, direction, strength.
struct DoseSeed {
  Vec3 position;  ///< its centre, mm, world frame W
  Vec3 axis;      ///< unit, along its length; the sign does not matter
  SourceModel source = SourceModel::kAmersham6711;
  double air_kerma_strength_u = 0;  ///< at the time of implantation; 1 U = 1 cGy cm²/h
};

}  // namespace brachy
