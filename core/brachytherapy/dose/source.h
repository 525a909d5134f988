#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "core/brachytherapy/dose/dose_seed.h"

namespace brachy {

/// The capsule of both sources: a cylinder about the seed's centre, mm (Rivard et al. 2004, section IV).
inline constexpr double kSeedLengthMm = 4.5, kSeedDiameterMm = 0.8;

/// A source's consensus data for the 2-D line-source formalism of TG-43U1. Lengths in cm, as the protocol has them.
///
/// Source: Rivard et al., "Update of AAPM Task Group No. 43 Report", Med. Phys. 31 (2004), 633–674, section IV (Λ, g_L
/// for the line source and F of each model); interpolated as in Rivard et al., "Supplement to the 2004 update of the
/// AAPM Task Group No. 43 Report", Med. Phys. 34 (2007), 2187–2205.
struct Tg43Source {
  SourceModel model;
  std::string_view name;         ///< as to_string() gives it
  std::string_view description;  ///< nuclide and manufacturer's name
  double half_life_days;
  double active_length_cm;              ///< L; not the capsule's length
  double dose_rate_constant;            ///< Λ, cGy/h/U
  std::span<const double> g_r_cm, g;    ///< radial dose function g_L(r), r increasing
  std::span<const double> F_r_cm;       ///< columns of F, increasing
  std::span<const double> F_theta_deg;  ///< rows of F, 0 … 90, increasing
  std::span<const double> F;            ///< anisotropy function, rows × columns, row by row

  double half_life_h() const { return 24 * half_life_days; }
};

/// The data of `model`; asserts for an unknown value. Threads: any.
const Tg43Source& tg43_source(SourceModel model);

/// "6711", "200"
std::string_view to_string(SourceModel model);
/// The model of that name, nothing for any other.
std::optional<SourceModel> find_source(std::string_view name);

}  // namespace brachy
