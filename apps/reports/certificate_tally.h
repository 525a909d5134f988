#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/injectivity/certificate.h"
#include "core/simulation/mesh_state.h"

namespace brachy {

/// What the certificates of a run come to: of every tick (brachyd, replay --offline) or of every frame a
/// viewer got.
/// Real-time: add is O(1), without allocation.
struct CertificateTally {
  std::uint64_t injective = 0, folded = 0, unknown = 0;  ///< by verdict; without a certificate: unknown
  std::uint64_t unflagged = 0;  ///< neither injective nor said to be otherwise by a StepFlag: must stay 0
  std::uint64_t nonfinite = 0;  ///< with a coordinate that is not finite: must stay 0
  std::uint64_t substepped = 0, clamped = 0, merged = 0, dropped = 0, solve_failed = 0, steep = 0,
                late = 0;  ///< by StepFlag
  double min_det_bound = Certificate::kNotKnown,
         min_vertex_det = Certificate::kNotKnown;  ///< NaN: none had one
  std::uint32_t max_substeps = 0;
  double max_held_mm = 0;
  double max_lag_mm = Certificate::kNotKnown;  ///< TickSummary::lag_mm; NaN: none told it
  double max_condition = 1;

  /// Of a tick.
  void add(const TickSummary& summary, bool finite) noexcept {
    add(summary.certificate, summary.step_flags, summary.lag_mm, finite);
  }
  /// Of a frame. `lag_mm`: NaN where it is not known.
  void add(const std::optional<Certificate>& certificate, std::uint32_t step_flags, double lag_mm,
           bool finite) noexcept {
    const auto flagged = [&](StepFlag flag) { return (step_flags & flag) != 0; };
    const Verdict verdict = certificate ? certificate->verdict : Verdict::kUnknown;
    if (verdict == Verdict::kInjective) {
      ++injective;
    } else {
      const bool is_fold = verdict == Verdict::kFolded;
      ++(is_fold ? folded : unknown);
      unflagged += !flagged(is_fold ? kStepFolded : kStepUncertified);
    }
    nonfinite += !finite;
    substepped += flagged(kStepSubstepped);
    clamped += flagged(kStepClamped);
    merged += flagged(kStepMerged);
    dropped += flagged(kStepDropped);
    solve_failed += flagged(kStepSolveFailed);
    steep += flagged(kStepSteep);
    late += flagged(kStepLate);
    // fmin and fmax pass over what is not known.
    max_lag_mm = std::fmax(max_lag_mm, lag_mm);
    if (!certificate) return;
    min_det_bound = std::fmin(min_det_bound, certificate->det_bound);
    min_vertex_det = std::fmin(min_vertex_det, certificate->vertex_det);
    max_substeps = std::max(max_substeps, certificate->substeps);
    max_held_mm = std::fmax(max_held_mm, certificate->held_mm);
    max_condition = std::fmax(max_condition, certificate->condition);
  }
};

inline bool all_finite(std::span<const float> values) noexcept {
  // Exponents by their bits: in integers the loop is vectorised, with isfinite it is not.
  constexpr std::uint32_t kExponent = 0x7f800000;
  std::uint32_t bad = 0;
  for (const float v : values) bad |= (std::bit_cast<std::uint32_t>(v) & kExponent) == kExponent;
  return bad == 0;
}

/// Whether every coordinate that this tick changed is finite. Real-time: costs nothing where nothing moves.
inline bool changes_are_finite(const MeshState& state, const std::vector<Block>& blocks) noexcept {
  bool finite = true;
  for (std::size_t b = 0; b < blocks.size(); ++b)
    if (state.mesh.block_ticks[b] == state.summary.tick)
      finite &= all_finite({&state.mesh.deformed_vertices[3 * std::size_t{blocks[b].first}],
                            3 * std::size_t{blocks[b].count}});
  return finite;
}

}  // namespace brachy
