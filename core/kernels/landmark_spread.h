#pragma once

#include <cstdint>

#include "core/base/rigid_transform.h"

namespace brachy {

/// How a landmark's force is spread over the tissue on the models that know forces (`elastic`, `fem`): over a core of
/// given radius, over the core that gives a lone landmark a given stiffness, or by the model's own rule (neither).
/// A tip that continues a shaft has its core for its force along the shaft only; across, it is the shaft's end. Alone
/// it may have another core across, so that what a needle feels from the side does not change by much where its shaft's
/// first landmark is added.
struct LandmarkSpread {
  double core_mm = 0;             ///< core radius; 0: as below
  double stiffness_n_per_mm = 0;  ///< of the landmark alone along `axis`; 0: the model's own rule
  Vec3 axis = Vec3::Zero();       ///< unit, where stiffness_n_per_mm or across_mm is given
  double across_mm = 0;           ///< with core_mm: core radius across `axis` of a tip alone; 0: core_mm
  std::int32_t behind = -1;       ///< of a tip: the shaft's last landmark

  bool operator==(const LandmarkSpread&) const = default;
};

}  // namespace brachy
