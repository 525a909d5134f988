#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace brachy {

/// A whole file. Errors: UserError "FILE: what; fix" where it is missing, in a folder that may not be entered, no
/// regular file, or larger than `max_bytes`. Threads: any.
std::string file_bytes(const std::filesystem::path& file, std::size_t max_bytes);

}  // namespace brachy
