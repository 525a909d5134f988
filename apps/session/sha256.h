#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace brachy {

/// SHA-256 (FIPS 180-4) as 64 hexadecimal digits.
std::string sha256_of(std::string_view bytes);

/// The same of a file's content, and its size. Throws UserError "FILE: what; fix" where it is no readable regular file.
struct FileDigest {
  std::string sha256;
  std::uint64_t bytes = 0;
};
FileDigest digest_of_file(const std::filesystem::path& file);

}  // namespace brachy
