#pragma once

#include <vector>

#include "core/brachytherapy/plan/gland_holes.h"
#include "core/brachytherapy/plan/plan.h"

namespace brachy {

/// Rules for the choice of needles and their seeds: modified peripheral loading (Yu et al., AAPM TG-64, Med. Phys. 26,
/// 1999, 2054–2076), more at the rim, less around the urethra. Lengths in mm.
struct LoadingRule {
  static constexpr double kLeastDepth = 1;    ///< GlandHole::depth_mm of a needle
  static constexpr double kRimDepth = 7;      ///< needles with less are rim needles, others interior ones
  static constexpr double kLeastLength = 12;  ///< of a needle's way through the gland

  double spacing;            ///< between needles, at least
  double urethra_clearance;  ///< between a needle and the urethra's surface, at least
  double rim_pitch;          ///< approximate, between a rim needle's seeds, which are spread evenly
  /// determines the count of an interior needle's seeds: at its ends, an odd one midway
  double interior_pitch;

  bool operator==(const LoadingRule&) const = default;
};

/// The rim needles, outermost first, each `spacing` from those before; then the interior ones, always the one farthest
/// from all others. Seeds lie from the far end of each needle's way through the gland to the near one, their centres
/// within; tips in whole mm beyond the template, at most at the far end. Anterior rows come first, as needles are
/// inserted. Every seed has 1 U. Empty where no hole is suitable.
Plan load_gland(const std::vector<GlandHole>& holes, const LoadingRule& rule);

}  // namespace brachy
