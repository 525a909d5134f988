#pragma once

#include <filesystem>
#include <string>

namespace brachy {

/// What a file holds, by one read of its size: sessions have files of 100 MB. What is written meanwhile is left out;
/// empty where it cannot be read.
std::string text_of_file(const std::filesystem::path& file);

/// Truncates a text file after its last line end, which removes a row that a killed process did not finish.
/// Returns whether there was one. Throws UserError if the file cannot be read or truncated.
bool truncate_partial_line(const std::filesystem::path& file);

/// The last line of a file of whole lines, without its end; empty where it has none. Throws UserError.
std::string last_line(const std::filesystem::path& file);

}  // namespace brachy
