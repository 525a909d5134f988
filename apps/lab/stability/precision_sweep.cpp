// Single precision where the engine takes double: the same systems, the factor and the solution in float. The weights'
// error is some 6e-8 times the condition, so landmarks are missed at conditions of a few thousand. And
// Buhmann's function as it is printed, which is NaN at 0 (0·ln 0) and in float slightly negative near r = 1
// (core/DESIGN.md, section 4).
#include <cmath>

#include "apps/lab/stability/landmark_systems.h"
#include "apps/lab/stability/sweeps.h"

namespace brachy {
namespace {

float printed_buhmann(float r) {
  const float r2 = r * r;
  return 12 * r2 * r2 * std::log(r) - 21 * r2 * r2 + 32 * r2 * r - 12 * r2 + 1;
}

void sweep_buhmann(StabilityReport& report) {
  const auto sweep = [&](const char* which, const auto& psi) {
    const auto fails = [&](float r) { return !(psi(r) >= 0); };
    std::optional<double> below;
    for (float r = 0.25f; r <= 1 && !below; r += 1e-5f)
      if (fails(r)) below = r;
    report.rows.push_back({.method = "buhmann",
                           .sweep = std::string("single precision, ") + which + " at r = 0",
                           .parameter = "r",
                           .at_failure = fails(0) ? std::optional(0.0) : std::nullopt,
                           .kind = "not finite"});
    report.rows.push_back({.method = "buhmann",
                           .sweep = std::string("single precision, ") + which + " below 0",
                           .parameter = "r",
                           .at_failure = below,
                           .swept_to = 1,
                           .kind = "not definite"});
  };
  sweep("ψ as printed", printed_buhmann);
  sweep("ψ of the engine", [](float r) { return Buhmann::value(r); });
}

}  // namespace

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
  sweep_buhmann(report);
}

}  // namespace brachy
