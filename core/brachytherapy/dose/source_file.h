#pragma once

#include <filesystem>
#include <string>

#include "core/brachytherapy/dose/dose_seed.h"

namespace brachy {

/// The source that a scene or a plan names: one of find_source(), or, with the ending .toml, a source file relative to
/// `directory`, which is read and registered (config/README.md, "Add a source").
/// Threads: one at a time, which reads scenes and plans. Errors: UserError, of one line: no such source or file, or as
/// parse_source() and add_source() say.
SourceModel resolve_source(const std::string& name_or_file, const std::filesystem::path& directory);

/// Registers a source file. Threads and errors as resolve_source().
SourceModel load_source(const std::filesystem::path& file);

}  // namespace brachy
