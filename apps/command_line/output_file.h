#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace brachy {

/// Writes an output file of a tool. Errors: UserError where that cannot be done.
void write_text(const std::filesystem::path& file, const std::string& text);

/// Checks before a long computation that the file's directory exists. Errors: UserError where it is missing.
void check_folder_of(const std::optional<std::filesystem::path>& file);

}  // namespace brachy
