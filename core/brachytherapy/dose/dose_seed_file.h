#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/dose/dose_seed.h"

namespace brachy {

/// The first line of a file of seeds whose dose is computed: centre (mm, world frame W), axis (of any length but 0),
/// number of its source (Tg43Source), and air-kerma strength at implantation in U.
inline constexpr std::string_view kDoseSeedHeader = "x,y,z,ax,ay,az,source,strength_u";

/// Parses such a text; `name` stands for the file in errors. Axes are normalised.
/// Errors: UserError "name:line: what; fix" for malformed text, an axis of length 0, an unknown source, a strength that
/// is not above 0.
std::vector<DoseSeed> parse_dose_seeds(std::string_view text, const std::string& name);

/// parse_dose_seeds of a file; UserError also where it is not a readable regular file.
std::vector<DoseSeed> load_dose_seeds(const std::filesystem::path& file);

/// The seeds as such a text, to the last bit.
std::string to_csv(const std::vector<DoseSeed>& seeds);

}  // namespace brachy
