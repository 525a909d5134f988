#pragma once

#include <filesystem>
#include <string>

namespace brachy {

/// Cuts what follows the last line end off a text file, the row that a killed process did not finish; true if there was
/// anything. Throws UserError where the file cannot be read or cut.
bool cut_off_torn_line(const std::filesystem::path& file);

/// The last line of a file of whole lines, without its end; empty where it has none. Throws UserError.
std::string last_line(const std::filesystem::path& file);

}  // namespace brachy
