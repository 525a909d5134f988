#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/dose/dose_seed.h"

namespace brachy {

/// The capsule of a permanent seed, as needles, plans and images have it: a cylinder about the seed's centre, mm
/// (Rivard et al. 2004, section IV).
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
  double active_length_cm;            ///< L; not the capsule's length
  double dose_rate_constant;          ///< Λ, cGy/h/U
  std::span<const double> g_r_cm, g;  ///< radial dose function g_L(r), r increasing
  std::span<const double> F_r_cm;     ///< columns of F, increasing
  /// rows of F, increasing: 0 … 90 of a source that is symmetric about its middle, 0 … 180 of another; 0 lies in the
  /// direction of DoseSeed::axis
  std::span<const double> F_theta_deg;
  std::span<const double> F;  ///< anisotropy function, rows × columns, row by row

  double capsule_length_mm = kSeedLengthMm,
         capsule_diameter_mm = kSeedDiameterMm;  ///< about the source's middle
  int number = 0;                                ///< stands for it in CSV files, whose columns are numbers
  bool is_permanent = true;  ///< a seed that stays; false: a source that is withdrawn again (HDR)
  double u_per_mci = 0;      ///< air-kerma strength for each mCi of apparent activity; 0: not stated
  std::string_view citation = {};

  double half_life_h() const { return 24 * half_life_days; }
  bool is_symmetric() const { return F_theta_deg.back() <= 90; }
};

/// The data of `model`; asserts for an unknown value. Threads: any.
const Tg43Source& tg43_source(SourceModel model);

/// "6711", "200", "cs1-rev2", "mhdr-v2", …, or the name in its file
std::string_view to_string(SourceModel model);
/// The model of that name or number: of those that are shipped, then of the files read so far. Nothing for any other.
/// Threads: not while a source file is read.
std::optional<SourceModel> find_source(std::string_view name_or_number);
/// find_source among those that are seeds, which stay.
std::optional<SourceModel> find_seed_source(std::string_view name_or_number);
/// "6711, 200, cs1-rev2 …", or those of temporary sources, for messages. Threads: as find_source.
std::string source_names(bool permanent = true);
/// All that are withdrawn again. Threads: as find_source.
std::vector<SourceModel> temporary_sources();

}  // namespace brachy
