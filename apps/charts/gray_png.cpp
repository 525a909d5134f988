#include "apps/charts/gray_png.h"

#include <zlib.h>

#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace brachy {
namespace {

void add_word(std::string& bytes, std::uint32_t word) {
  for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(word >> shift & 0xFFU);
}

void add_chunk(std::string& png, std::string_view type, std::string_view data) {
  add_word(png, static_cast<std::uint32_t>(data.size()));
  const std::string chunk = std::string(type) + std::string(data);
  png += chunk;
  std::vector<Bytef> raw(chunk.begin(), chunk.end());
  add_word(png, static_cast<std::uint32_t>(crc32(0, raw.data(), static_cast<uInt>(raw.size()))));
}

}  // namespace

std::string to_png(const GrayImage& image) {
  std::vector<Bytef> rows;  // each with its filter type, 0
  for (std::size_t row = 0; row < image.height; ++row) {
    rows.push_back(0);
    const auto of_row = image.pixels.subspan(row * image.width, image.width);
    rows.insert(rows.end(), of_row.begin(), of_row.end());
  }
  uLongf size = compressBound(static_cast<uLong>(rows.size()));
  std::vector<Bytef> packed(size);
  if (compress2(packed.data(), &size, rows.data(), static_cast<uLong>(rows.size()), 6) != Z_OK)
    throw UserError("the image cannot be compressed; free some memory");
  std::string header;
  add_word(header, static_cast<std::uint32_t>(image.width));
  add_word(header, static_cast<std::uint32_t>(image.height));
  header += std::string("\x08\x00\x00\x00\x00", 5);  // 8 bits, gray, no interlace
  std::string png("\x89PNG\r\n\x1a\n", 8);
  add_chunk(png, "IHDR", header);
  add_chunk(png, "IDAT", std::string(packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size)));
  add_chunk(png, "IEND", "");
  return png;
}

std::string to_base64(const std::string& bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8U | (n + k < bytes.size() ? static_cast<std::uint8_t>(bytes[n + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += n + k > bytes.size() ? '=' : kDigits[three >> (18 - 6 * k) & 63U];
  }
  return text;
}

}  // namespace brachy
