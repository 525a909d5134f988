#pragma once

#include <filesystem>

namespace brachy {

/// Opens a file of a session to append to it, and creates it where it is missing. It must be a regular file, and is of
/// mode 0600 from here on. The caller closes the descriptor. Throws UserError that names the fix.
int open_session_file(const std::filesystem::path& file);

}  // namespace brachy
