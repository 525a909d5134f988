#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace brachy {

/// Writes a file that a tool was asked for. Errors: UserError where that cannot be done.
void write_text(const std::filesystem::path& file, const std::string& text);

/// UserError where the file's folder is missing: known before minutes of work, not after.
void check_folder_of(const std::optional<std::filesystem::path>& file);

}  // namespace brachy
