#pragma once

#include <functional>
#include <vector>

#include "apps/score/explanation/cause.h"
#include "apps/score/explanation/deviation.h"
#include "apps/score/explanation/plane_motion.h"

namespace brachy {

/// A session's deviation, taken apart.
struct Explanation {
  std::vector<Cause> causes;
  PlaneMotion of_template;     ///< of all needles together
  double depth_of_all_mm = 0;  ///< the same along them
  double shrinks_by = 0;       ///< share of a swollen gland's size that is gone when seeds rest

  /// What the causes that it shares with others do to a seed that never fell: −planned position. `near`: a seed of
  /// its needle that fell, null: none did.
  Vec3 expected_of(const Vec3& planned, const SeedDeviation* near, std::size_t at) const;
};

/// A needle or seed within this of its plan lies right, and is never a member of a cause of its own. mm.
inline constexpr double kRightMm = 2;

/// Takes a deviation apart, from what all needles share to single seeds: a rigid motion of the template, with or
/// without left and right exchanged, and its depth; needles that changed places; groups of needles that share a
/// shift, a turn or a depth; single needles; trains that were stretched; single seeds; and what the tissue did. Each
/// is a model that is fitted to those that follow it (members are those within reach, the rest do not count), and is
/// taken where it explains more than its parameters cost. Deviations that the core of the session's own scatter has
/// are none; a scatter of everything is a cause of its own. Deterministic; milliseconds.
Explanation explain(const Deviations& deviations);

}  // namespace brachy
