// Single precision where the engine takes double: the same systems, the factor and the solution in float. The weights'
// error is some 6e-8 times the condition, so landmarks are missed at conditions of a few thousand.
#include "apps/stability/landmark_systems.h"
#include "apps/stability/sweeps.h"

namespace brachy {

void sweep_precision(StabilityScene& scene, StabilityReport& report) {
  for (const SystemFamily& family : system_families(scene))
    for (const bool asks_factor : {true, false}) {
      if (asks_factor && !family.is_definite) continue;
      const auto fails = [&](double value) {
        const auto K = family.matrix(value);
        if (!K) return true;
        const Solved solved = solve_in<float>(*K, family.is_definite);
        return asks_factor ? !solved.has_factor : !(solved.missed < kMissed);
      };
      report.rows.push_back({.method = family.method,
                             .sweep = "single precision, " + family.landmarks,
                             .parameter = family.parameter,
                             .at_failure = first_failure(family.from, family.to, fails),
                             .swept_to = family.to,
                             .kind = asks_factor ? "not definite" : "inaccurate"});
    }
}

}  // namespace brachy
