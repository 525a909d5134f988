#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace brachy {

/// The content of gzip or zlib data (`name` stands for the file in errors). Errors: UserError where it is damaged, cut
/// off, or longer than `most_bytes`.
std::string inflated(std::string_view bytes, const std::string& name, std::size_t most_bytes);

/// A whole file. Errors: UserError where it is missing, no regular file, or longer than `most_bytes`.
std::string file_bytes(const std::string& file, std::size_t most_bytes);

inline constexpr std::size_t kMostFileBytes = std::size_t{2} << 30, kMostVoxels = std::size_t{1} << 29;

}  // namespace brachy
