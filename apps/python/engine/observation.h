#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "core/simulation/mesh_state.h"
#include "core/simulation/simulator.h"

namespace brachy {

struct ObservationField {
  std::string_view name;
  std::size_t size;
};

/// What one needle's observation consists of, in this order. Frame W, mm, N. All numbers are finite.
inline constexpr auto kObservationFields = std::to_array<ObservationField>({
    {"tip_mm", 3},       // of a needle that bends where its tip is
    {"tip_axis", 3},     // unit, the tip's tangent
    {"bend_mm", 3},      // the tip off where the pose puts it
    {"tip_rest_mm", 3},  // the tip's material point, at rest; outside the tissue the tip itself
    {"force_n", 3},      // of the tissue on the needle
    {"axial_n", 1},      // > 0 pushes it out
    {"lateral_n", 1},    // ≥ 0
    {"cutting_n", 1},
    {"friction_n", 1},
    {"tip_depth_mm", 1},
    {"insertion_depth_mm", 1},
    {"contact", 1},       // ContactState
    {"organs_in", 1},     // organs that some part of the needle is in
    {"organ_passes", 1},  // passes through organs, since the start
    {"verdict", 1},       // Verdict of the certificate
    {"det_bound", 1},     // of the certificate; 0: not known
    {"substeps", 1},      // of the certificate
    {"held_mm", 1},       // of the certificate
    {"lag_mm", 1},        // TickSummary::lag_mm
    {"max_displacement_mm", 1},
    {"step_flags", 1},  // StepFlag bits
});

inline constexpr std::size_t kObservationSize = [] {
  std::size_t sum = 0;
  for (const ObservationField& field : kObservationFields) sum += field.size;
  return sum;
}();

/// Writes the observation of instrument `id` after the last step of `simulator`, which wrote `state`.
/// Real-time: no allocation.
void write_observation(const MeshState& state, const Simulator& simulator, std::size_t id,
                       std::span<double, kObservationSize> out) noexcept;

}  // namespace brachy
