#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "apps/score/dose_score.h"
#include "apps/score/score.h"

namespace brachy {

/// At the top of the page.
inline constexpr std::size_t kTopFindings = 5;

// Figures of a report as text; a dash where the value is not known.

inline std::string figure(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "–";
}

inline std::string figure(const std::optional<std::uint32_t>& count) {
  return count ? std::to_string(*count) : "–";
}

/// Without the sign of a figure that rounds to zero.
inline double figure_or_zero(double value) {
  return std::abs(value) < 0.05 ? 0.0 : value;
}

/// Decimal places that are meaningful: percents and Gy to a tenth, cm³ to a hundredth.
inline std::string figure_in(const DoseStage& stage, const DoseFigure& f) {
  return figure(figure_of(stage, f), f.unit == std::string_view("cm³") ? 2 : 1);
}

/// What is left once every cause is taken away; with Score::unexplained.
inline std::string unexplained_text(const Score& score) {
  const Unexplained& left = *score.unexplained;
  return fmt::format(
      "{}: V100 {:+.1f} points, D90 {:+.1f} Gy against the plan, with seeds {:.1f} mm off on the mean, "
      "{:.1f} at most.",
      score.findings.empty() ? "Without any single cause" : "What no cause above explains",
      figure_or_zero(left.change.v100_percent), figure_or_zero(left.change.d90_gy), left.mean_mm,
      left.largest_mm);
}

}  // namespace brachy
