#pragma once

#include "apps/options.h"
#include "haptics/trajectory.h"

namespace brachy {

/// The trajectory where the options put it: centred on the tissue's box if asked, then translated, then sped up.
inline Trajectory place(Trajectory trajectory, const ReplayOptions& options, bool centre,
                        const Vec3& tissue_centre) {
  if (centre) trajectory = trajectory.centred_on(tissue_centre);
  trajectory = trajectory.transformed({Mat3::Identity(), options.translate_mm});
  if (options.speed == 1) return trajectory;
  std::vector<TrajectorySample> samples = trajectory.samples();
  for (TrajectorySample& sample : samples) sample.t_s /= options.speed;
  return Trajectory(std::move(samples));
}

}  // namespace brachy
