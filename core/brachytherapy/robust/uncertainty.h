#pragma once

#include "core/base/rigid_transform.h"

namespace brachy {

/// What a plan cannot know of the treatment that it leads to: standard deviations of normal errors with mean 0, each
/// drawn by itself. Those of lengths beyond three standard deviations are drawn again.
///
/// The values are those of Kennedy, Douglass, Santos (Phys. Eng. Sci. Med. 46, 2023, 1115–1130; one fraction of HDR,
/// catheters seen by ultrasound), who name for each the studies that it is from; percents also Kirisits et al.
/// (Radiother. Oncol. 110, 2014, 199–212). Drift and swelling have no value for a plan that is given at once.
struct UncertaintySettings {
  double strength_percent = 3;     ///< of the source or the batch of seeds
  double calculation_percent = 3;  ///< of the dose by TG-43
  double medium_percent = 1;       ///< tissue in place of water
  double dwell_s = 0.06;           ///< each dwell's time
  double source_along_mm = 1;      ///< the source in each catheter
  double reconstruction_along_mm = 1.1, reconstruction_across_mm = 1.2;  ///< each catheter in the images
  double movement_along_mm = 0.34, movement_across_mm = 0.86;  ///< each, in the gland, until treatment
  double drift_mm = 0;  ///< all catheters along themselves: between fractions 1.8
  double gland_outline_mm = 1, urethra_outline_mm = 0.25, organ_outline_mm = 0.5;  ///< surfaces, outwards
  Vec3 gland_movement_mm{0.1, 0.5, 0};  ///< gland, urethra and implant against other organs; world
  double swelling_percent = 0;          ///< of the gland's volume, with what is in it

  bool operator==(const UncertaintySettings&) const = default;
};

/// How seeds come to lie beside their plan: standard deviations as [noise] of a scene has them
/// (core/simulation/clinical_noise.h), mm.
struct SeedMisplacement {
  double play_mm = 0.7;                    ///< each needle, across, in either direction
  double along_mm = 1.8, across_mm = 1.2;  ///< each seed
  double migration_mm = 1.5;               ///< each seed, always backwards
};

}  // namespace brachy
