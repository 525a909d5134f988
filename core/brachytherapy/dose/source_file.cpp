#include "core/brachytherapy/dose/source_file.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "core/base/denied_folder.h"
#include "core/base/error.h"
#include "core/base/one_line.h"
#include "core/base/toml_precheck.h"
#include "core/brachytherapy/dose/loaded_source.h"

namespace brachy {

SourceModel load_source(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code error;
  refuse_denied_folder(file);
  if (!std::filesystem::is_regular_file(file, error))
    throw UserError(
        name +
        ": no such source file; give one, relative to the file that names it, or one of: " + source_names());
  if (std::filesystem::file_size(file, error) > TomlLimits::kMaxBytes)
    throw UserError(name + ": larger than 1 MiB; a source file is a page of TOML");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw UserError(name + ": cannot be read; check its permissions");
  SourceTables tables = parse_source(text.str(), name);
  if (const auto model = find_source(tables.name); model && *model < SourceModel::kIsoRayCs1) {
    // 6711 and 200 are C++ tables; their files say the same.
    const Tg43Source &own = tables.view(*model), &shipped = tg43_source(*model);
    const auto same = [](std::span<const double> a, std::span<const double> b) {
      return std::ranges::equal(a, b);
    };
    if (own.number == shipped.number && own.half_life_days == shipped.half_life_days &&
        own.dose_rate_constant == shipped.dose_rate_constant &&
        own.active_length_cm == shipped.active_length_cm && same(own.g_r_cm, shipped.g_r_cm) &&
        same(own.g, shipped.g) && same(own.F_r_cm, shipped.F_r_cm) &&
        same(own.F_theta_deg, shipped.F_theta_deg) && same(own.F, shipped.F))
      return *model;
  }
  return add_source(std::move(tables), name);
}

SourceModel resolve_source(const std::string& name_or_file, const std::filesystem::path& directory) {
  if (name_or_file.ends_with(".toml")) return load_source(directory / name_or_file);
  if (const auto model = find_source(name_or_file)) return *model;
  throw UserError("no source \"" + one_short_line(name_or_file) + "\"; use one of " + source_names() +
                  ", or the name of a source file that ends in .toml");
}

}  // namespace brachy
