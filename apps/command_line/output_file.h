#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace brachy {

/// Writes an output file of a tool. Errors: UserError where that cannot be done.
void write_text(const std::filesystem::path& file, const std::string& text);

/// Checks before a long computation that the file's directory exists. Errors: UserError where it is missing.
void check_folder_of(const std::optional<std::filesystem::path>& file);

/// Checks before a long computation that no file would be lost. Errors: UserError where a regular file of that name
/// exists, unless `force`.
void check_is_new(const std::optional<std::filesystem::path>& file, bool force);

/// Checks that an output is not one of the files that are read, whatever their names. Errors: UserError.
void check_is_no_input(const std::filesystem::path& out,
                       const std::vector<std::optional<std::filesystem::path>>& inputs);

}  // namespace brachy
