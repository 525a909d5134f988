#include "core/brachytherapy/dose/dose_nrrd.h"

#include <bit>
#include <cstdint>

#include "core/base/number_text.h"

namespace brachy {
namespace {

// With enough digits that the same bits are read back.
std::string vector_text(const Vec3& v) {
  std::string text;
  for (int k = 0; k < 3; ++k) text.append(k == 0 ? "(" : ",").append(exact_text(v[k]));
  return text.append(")");
}

}  // namespace

std::string to_nrrd(const DoseGrid& grid) {
  const auto [nx, ny, nz] = grid.size();
  const double h = grid.spacing_mm();
  std::string text =
      "NRRD0004\n"
      "# Total dose of the seeds' whole decay, AAPM TG-43U1\n"
      "content: dose\n"
      "type: float\n"
      "dimension: 3\n"
      "space: right-anterior-superior\n"
      "sizes: " +
      std::to_string(nx) + " " + std::to_string(ny) + " " + std::to_string(nz) + "\n" +
      "space directions: " + vector_text(Vec3(h, 0, 0)) + " " + vector_text(Vec3(0, h, 0)) + " " +
      vector_text(Vec3(0, 0, h)) +
      "\n"
      "kinds: domain domain domain\n"
      "sample units: Gy\n"
      "endian: little\n"
      "encoding: raw\n"
      "space units: \"mm\" \"mm\" \"mm\"\n"
      "space origin: " +
      vector_text(grid.origin()) + "\n\n";
  text.reserve(text.size() + 4 * grid.dose_gy().size());
  for (const float dose : grid.dose_gy()) {
    const auto bits = std::bit_cast<std::uint32_t>(dose);
    for (int byte = 0; byte < 4; ++byte) text += static_cast<char>(bits >> (8 * byte) & 0xff);
  }
  return text;
}

}  // namespace brachy
