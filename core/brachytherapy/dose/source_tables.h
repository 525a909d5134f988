#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/dose/source.h"

namespace brachy {

/// The content of a source file: what Tg43Source refers to. Lengths in cm as there, in mm where the name says so.
struct SourceTables {
  static constexpr std::size_t kLongestText = 300;  ///< bytes
  static constexpr std::size_t kMostNodes = 400;    ///< of r or θ in a table
  static constexpr double kFarthestCm = 100;        ///< r
  static constexpr double kReferenceTolerance =
      0.02;  ///< of g(1 cm) and F(r, 90°), which are 1 by definition

  std::string name, description, citation, doi;
  int number = 0;
  bool is_permanent = true;
  double half_life_days = 0, dose_rate_constant = 0, active_length_cm = 0;
  double capsule_length_mm = kSeedLengthMm, capsule_diameter_mm = kSeedDiameterMm;
  double u_per_mci = 0;
  std::vector<double> g_r_cm, g;
  std::vector<double> F_r_cm, F_theta_deg, F;  ///< F row by row; what the file leaves open (nan) is filled

  /// A view of these tables, which must stay where they are.
  Tg43Source view(SourceModel model) const;

  bool operator==(const SourceTables&) const = default;
};

/// Parses a source file (config/README.md, "Add a source"); `name` stands for the file in errors.
/// Errors: UserError "name:line: what; fix" for text beyond the limits of core/base/toml_precheck.h, invalid TOML, an
/// unknown or missing key, a number out of range, nodes that do not increase, tables of different sizes, g(1 cm) or
/// F(r, 90°) that is not 1, a row without a value.
SourceTables parse_source(std::string_view text, const std::string& name);

}  // namespace brachy
