#pragma once

namespace brachy {

/// Where dose is computed: on a grid over the prostate plus a margin, and in the parts of other structures within it.
struct DoseSettings {
  double prescription_gy = 145;  ///< D90 and V100 are of this; 1 … 1000
  double spacing_mm = 1;         ///< of the grid, 0.25 … 10
  double margin_mm = 10;         ///< around the prostate's box, 0 … 50

  bool operator==(const DoseSettings&) const = default;
};

}  // namespace brachy
