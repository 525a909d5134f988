#pragma once

#include <string>

namespace brachy {

/// Where dose is computed: on a grid over the prostate plus a margin, and in the parts of other structures within it.
struct DoseSettings {
  double prescription_gy = 145;  ///< D90 and V100 are of this; 1 … 1000
  double spacing_mm = 1;         ///< of the grid, 0.25 … 10
  double margin_mm = 10;         ///< around the prostate's box, 0 … 50
  /// The source of unplanned seeds, of generated plans and of dwells: a name, or a source file relative to the scene
  /// (core/brachytherapy/dose/source_file.h). Empty: seeds.source, and mhdr-v2 for HDR.
  std::string source;

  bool operator==(const DoseSettings&) const = default;
};

}  // namespace brachy
