#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/score/recording.h"
#include "apps/score/spread.h"
#include "core/brachytherapy/plan/template_grid.h"
#include "haptics/trajectory/needle_metrics.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

/// The motion through one hole of the template. Without poses only `hole` and `planned` are known.
struct NeedleScore {
  std::string hole;                    ///< empty: in the tissue, but not through a hole of the template
  std::optional<std::size_t> planned;  ///< index in the planned holes; nothing: the plan has no needle here
  std::optional<std::uint32_t> passes, punctures;
  std::optional<std::uint32_t>
      insertions;                    ///< passes that went in forwards: not back from beyond the gland's base
  std::vector<double> insertions_s;  ///< when each of them began
  double path_in_tissue_mm = kNoNumber, time_in_tissue_s = kNoNumber;
  double largest_force_n = kNoNumber;
};

struct NeedlesScore {
  /// the plan's in its order, then other holes by name, then beside the template
  std::vector<NeedleScore> needles;
  std::optional<NeedleMetrics> motion;  ///< of all the device's needles; nothing: no poses
  std::optional<std::uint32_t> punctures;
  double largest_force_n = kNoNumber;
};

/// The holes of a plan's needles or catheters, in their order.
template <class Planned>
std::vector<std::string> holes_of(const std::vector<Planned>& planned) {
  std::vector<std::string> holes;
  for (const Planned& one : planned) holes.push_back(one.hole);
  return holes;
}

/// A device's needle is the plan's whose hole its line goes through while its tip is in the tissue (for most of the
/// time of each stay in it). Punctures are those of the outer capsule that the force log shows: touching in one row,
/// inserted in the next. `planned`: the holes of the plan's needles, in its order. `poses` null, `forces` empty: not
/// known.
NeedlesScore score_needles(std::span<const std::string> planned, const TemplateGrid& grid,
                           const NeedleTrajectories* poses, std::span<const RecordedForce> forces,
                           const InsideTest& inside);

}  // namespace brachy
