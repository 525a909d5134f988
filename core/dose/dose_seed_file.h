#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/dose/dose_seed.h"

namespace brachy {

/// The first line of a file of seeds to add up the dose of: centre (mm, world frame W), axis (of any length but 0),
/// source 6711 or 200, and air-kerma strength at implantation in U.
inline constexpr std::string_view kDoseSeedHeader = "x,y,z,ax,ay,az,source,strength_u";

/// Reads such a text; `name` is what errors call it. Axes come out of unit length.
/// Errors: UserError "name:line: what; fix" for what is no such text, an axis of length 0, an unknown source, a
/// strength that is not above 0.
std::vector<DoseSeed> parse_dose_seeds(std::string_view text, const std::string& name);

/// parse_dose_seeds of a file; UserError also where it is no readable regular file.
std::vector<DoseSeed> load_dose_seeds(const std::filesystem::path& file);

}  // namespace brachy
