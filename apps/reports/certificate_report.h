#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "apps/reports/certificate_tally.h"

namespace brachy {

/// Adds the tally to a tool's JSON; `counted` is "ticks" or "frames". What is not known is null.
inline void add_to_json(nlohmann::ordered_json& json, const std::string& counted,
                        const CertificateTally& tally) {
  json[counted + "_injective"] = tally.injective;
  json[counted + "_folded"] = tally.folded;
  json[counted + "_unknown"] = tally.unknown;
  json[counted + "_unflagged"] = tally.unflagged;
  json[counted + "_substepped"] = tally.substepped;
  json[counted + "_clamped"] = tally.clamped;
  json[counted + "_merged"] = tally.merged;
  json[counted + "_dropped"] = tally.dropped;
  json[counted + "_solve_failed"] = tally.solve_failed;
  json["min_det_bound"] = tally.min_det_bound;
  json["min_vertex_det"] = tally.min_vertex_det;
  json["max_substeps"] = tally.max_substeps;
  json["max_held_mm"] = tally.max_held_mm;
  json[counted + "_late"] = tally.late;
  json["max_lag_mm"] = tally.max_lag_mm;
  json["max_condition"] = tally.max_condition;
  json["nonfinite"] = tally.nonfinite;
  json[counted + "_steep"] = tally.steep;
}

/// Of one tick: the verdict, the least det that is known, what guarded the field, and how far the tissue lags behind
/// it (NaN: not known).
inline std::string one_line(const std::optional<Certificate>& certificate, std::uint32_t step_flags,
                            double lag_mm) {
  std::string text(to_string(Verdict::kUnknown));
  if (certificate) {
    const Certificate& c = *certificate;
    text = fmt::format("{} det {:.3f}", to_string(c.verdict), std::fmin(c.det_bound, c.vertex_det));
    if (step_flags & kStepSubstepped) text += fmt::format(" sub-steps {}", c.substeps);
    if (step_flags & kStepClamped) text += fmt::format(" held {:.1f} mm", c.held_mm);
  }
  if (step_flags & kStepLate) text += std::isnan(lag_mm) ? " late" : fmt::format(" late {:.2f} mm", lag_mm);
  return text;
}

/// How many ticks or frames were late, and by how far at most (NaN: not known), as the end of a list; "" of none.
inline std::string late_text(std::uint64_t late, double max_lag_mm) {
  if (late == 0) return {};
  if (std::isnan(max_lag_mm)) return fmt::format(", {} late", late);
  return fmt::format(", {} late (tissue at most {:.2f} mm behind)", late, max_lag_mm);
}

/// Two lines for people; `counted` is "ticks" or "frames".
inline std::string to_text(const std::string& counted, const CertificateTally& tally) {
  const auto known = [](double det) {
    return std::isnan(det) ? std::string("not known") : fmt::format("{:.3f}", det);
  };
  return fmt::format(
      "  {}: {} injective, {} folded, {} unknown; least det: bound {}, at vertices {}\n"
      "  guard: {} with sub-steps (at most {}), {} clamped (at most {:.2f} mm), {} merged, {} left "
      "out{}{}{}{}{}\n",
      counted, tally.injective, tally.folded, tally.unknown, known(tally.min_det_bound),
      known(tally.min_vertex_det), tally.substepped, tally.max_substeps, tally.clamped, tally.max_held_mm,
      tally.merged, tally.dropped, late_text(tally.late, tally.max_lag_mm),
      tally.steep ? fmt::format(", {} with a needle bent by more than 8°", tally.steep) : "",
      tally.solve_failed ? fmt::format(", {} NOT SOLVED", tally.solve_failed) : "",
      tally.unflagged ? fmt::format(", {} NOT FLAGGED", tally.unflagged) : "",
      tally.nonfinite ? fmt::format(", {} NOT FINITE", tally.nonfinite) : "");
}

}  // namespace brachy
