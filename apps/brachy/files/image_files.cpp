#include "apps/brachy/files/image_files.h"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace brachy {
namespace {

void write_bytes(const std::filesystem::path& file, std::string_view bytes) {
  std::ofstream out(file, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw UserError(file.string() + ": cannot be written; check the folder and the free space");
}

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

std::string vector_text(const Vec3& v) {
  return fmt::format("({:.17g},{:.17g},{:.17g})", v.x(), v.y(), v.z());
}

}  // namespace

void write_png(const std::filesystem::path& file, const GrayImage& image) {
  std::vector<Bytef> rows;  // each with its filter type, 0
  for (std::size_t row = 0; row < image.height; ++row) {
    rows.push_back(0);
    const auto of_row = image.pixels.subspan(row * image.width, image.width);
    rows.insert(rows.end(), of_row.begin(), of_row.end());
  }
  uLongf size = compressBound(static_cast<uLong>(rows.size()));
  std::vector<Bytef> packed(size);
  if (compress2(packed.data(), &size, rows.data(), static_cast<uLong>(rows.size()), 6) != Z_OK)
    throw UserError(file.string() + ": zlib cannot compress the image; free some memory");
  std::string header;
  add_word(header, static_cast<std::uint32_t>(image.width));
  add_word(header, static_cast<std::uint32_t>(image.height));
  header += std::string("\x08\x00\x00\x00\x00", 5);  // 8 bits, gray, no interlace
  std::string png("\x89PNG\r\n\x1a\n", 8);
  add_chunk(png, "IHDR", header);
  add_chunk(png, "IDAT", std::string(packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size)));
  add_chunk(png, "IEND", "");
  write_bytes(file, png);
}

void write_nrrd(const std::filesystem::path& file, const GrayImage& image, const RigidTransform& X_WG,
                double spacing_mm, double thickness_mm) {
  std::string text = fmt::format(
      "NRRD0005\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: {} {} 1\n"
      "space directions: {} {} {}\nspace origin: {}\nkinds: domain domain domain\nencoding: raw\n\n",
      image.width, image.height, vector_text(spacing_mm * X_WG.R.col(0)),
      vector_text(spacing_mm * X_WG.R.col(1)), vector_text(thickness_mm * X_WG.R.col(2)),
      vector_text(X_WG.p));
  text.append(image.pixels.begin(), image.pixels.end());
  write_bytes(file, text);
}

}  // namespace brachy
