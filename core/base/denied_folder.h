#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace brachy {

/// The folder on the way to `file` that this process may not enter, so that nothing can be said about the file itself;
/// nullopt: there is none.
std::optional<std::filesystem::path> denied_folder(const std::filesystem::path& file);

/// Throws UserError "FILE: no permission to enter the folder FOLDER; …" where there is one: before "no such file" is
/// said of a file that may well be there.
void refuse_denied_folder(const std::filesystem::path& file);

}  // namespace brachy
