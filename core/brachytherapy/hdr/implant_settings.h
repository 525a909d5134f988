#pragma once

#include <string>

namespace brachy {

/// The kind of implant, and an afterloader's source. Lengths in mm.
struct ImplantSettings {
  static constexpr int kMaxCatheters = 24;
  static constexpr double kUPerCi = 4030;  ///< Ir-192, 4.03 U for each mCi (Nath et al., AAPM TG-43, 1995)
  static constexpr double kFractionGy = 13.5;  ///< dose.prescription_gy where a scene of HDR has none

  /// "ldr": needles leave seeds. "hdr": needles are catheters that stay, and a source dwells in them.
  std::string kind = "ldr";
  /// CSV of seeds that are in the body at the start (load_seeds_in_place), relative to the scene file; empty: none.
  std::string seeds;
  double step_mm = 5;                       ///< between dwell positions: 2.5 or 5
  double tip_offset_mm = 5;                 ///< of the first dwell position behind the catheter's tip
  int max_catheters = 18;                   ///< of a generated plan
  double source_strength_u = 10 * kUPerCi;  ///< air-kerma strength on the day

  bool is_hdr() const { return kind == "hdr"; }
  bool operator==(const ImplantSettings&) const = default;
};

}  // namespace brachy
