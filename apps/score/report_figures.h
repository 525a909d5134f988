#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "apps/score/dose_score.h"

namespace brachy {

/// At the top of the page.
inline constexpr std::size_t kTopFindings = 3;

// Figures of a report as text; a dash where the value is not known.

inline std::string figure(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "–";
}

inline std::string figure(const std::optional<std::uint32_t>& count) {
  return count ? std::to_string(*count) : "–";
}

/// Decimal places that are meaningful: percents and Gy to a tenth, cm³ to a hundredth.
inline std::string figure_in(const DoseStage& stage, const DoseFigure& f) {
  return figure(figure_of(stage, f), f.unit == std::string_view("cm³") ? 2 : 1);
}

}  // namespace brachy
