#pragma once

#include <vector>

#include "core/plan/gland_holes.h"
#include "core/plan/plan.h"

namespace brachy {

/// Which holes get a needle, and what it gets: modified peripheral loading (Yu et al., AAPM TG-64, Med. Phys. 26, 1999,
/// 2054–2076), more at the rim, less around the urethra. Lengths in mm.
struct LoadingRule {
  static constexpr double kLeastDepth = 1;  ///< GlandHole::depth_mm of a needle
  static constexpr double kRimDepth = 7;    ///< needles with less of it are the rim's, others the interior's
  static constexpr double kLeastLength = 12;  ///< of a needle's way through the gland

  double spacing;            ///< between needles, at least
  double urethra_clearance;  ///< between a needle and the urethra's surface, at least
  double rim_pitch;          ///< about, between a rim needle's seeds, which are spread evenly
  double interior_pitch;  ///< sets an interior needle's seeds: they go to its ends, an odd one to its middle

  bool operator==(const LoadingRule&) const = default;
};

/// The rim's needles, outermost first, each `spacing` from those before; then the interior's, always the one farthest
/// from all others. Seeds lie from the far end of each needle's way through the gland to the near one, their centres
/// within; tips in whole mm beyond the template, at most at the far end. Anterior rows come first, as needles are
/// inserted. Every seed has 1 U. No hole is left: no needles.
Plan load_gland(const std::vector<GlandHole>& holes, const LoadingRule& rule);

}  // namespace brachy
