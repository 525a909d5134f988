#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace brachy {

/// A gray image: rows from the top, height × width values.
struct GrayImage {
  std::size_t width = 0, height = 0;
  std::span<const std::uint8_t> pixels;
};

/// An 8-bit gray PNG (ISO/IEC 15948), compressed by zlib: the bytes of a file. Errors: UserError where there is too
/// little memory.
std::string to_png(const GrayImage& image);

/// Bytes in Base64 (RFC 4648, 4).
std::string to_base64(const std::string& bytes);

}  // namespace brachy
