#pragma once

#include "apps/brachy/replay/replay.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

/// The trajectories placed by the options: centred on the tissue's box if requested, then translated, then sped up.
inline NeedleTrajectories place(NeedleTrajectories trajectories, const ReplayOptions& options, bool centre,
                                const Vec3& tissue_centre) {
  if (centre) trajectories = trajectories.centred_on(tissue_centre);
  trajectories = trajectories.transformed({Mat3::Identity(), options.translate_mm});
  return options.speed == 1 ? trajectories : trajectories.sped_up(options.speed);
}

}  // namespace brachy
