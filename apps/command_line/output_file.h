#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace brachy {

/// Writes an output file of a tool, whole or not at all: by another name beside it, and a rename. One that exists is
/// refused unless `force`; a device or a FIFO is written to. Errors: UserError where that cannot be done.
void write_text(const std::filesystem::path& file, const std::string& text, bool force = false);

/// Checks before a long computation that the file can be written: its directory is there, and no file would be lost.
/// Errors: UserError where it is not, or a file of that name exists, unless `force`.
void check_output(const std::optional<std::filesystem::path>& file, bool force);

/// Checks that an output is not one of the files that are read, whatever their names. Errors: UserError.
void check_is_no_input(const std::filesystem::path& out,
                       const std::vector<std::optional<std::filesystem::path>>& inputs);

}  // namespace brachy
