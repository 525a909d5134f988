#include "apps/brachy/files/image_files.h"

#include <fmt/format.h>

#include <fstream>
#include <string>
#include <string_view>

#include "core/base/error.h"

namespace brachy {
namespace {

void write_bytes(const std::filesystem::path& file, std::string_view bytes) {
  std::ofstream out(file, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw UserError(file.string() + ": cannot be written; check the folder and the free space");
}

std::string vector_text(const Vec3& v) {
  return fmt::format("({:.17g},{:.17g},{:.17g})", v.x(), v.y(), v.z());
}

}  // namespace

void write_png(const std::filesystem::path& file, const GrayImage& image) {
  write_bytes(file, to_png(image));
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
