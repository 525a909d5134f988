#include "apps/score/axial_slices.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/surface/plane_section.h"

namespace brachy {
namespace {

using Point = std::array<double, 2>;

OutlinePieces cut(const SurfaceMesh& mesh, double z) {
  OutlinePieces pieces;
  for (const auto& [from, to] : plane_section(mesh, {Mat3::Identity(), Vec3(0, 0, z)}))
    pieces.push_back({from.x(), from.y(), to.x(), to.y()});
  return pieces;
}

// One square of four points, counterclockwise: its edges that the level crosses, in pairs.
void add_square(const std::array<double, 4>& gy, const std::array<Point, 4>& at, double level,
                OutlinePieces& pieces) {
  std::array<Point, 4> crossed{};
  std::size_t count = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t next = (k + 1) % 4;
    if ((gy[k] < level) == (gy[next] < level)) continue;
    const double t = (level - gy[k]) / (gy[next] - gy[k]);
    crossed[count++] = {at[k][0] + t * (at[next][0] - at[k][0]), at[k][1] + t * (at[next][1] - at[k][1])};
  }
  for (std::size_t i = 0; i + 1 < count; i += 2)
    pieces.push_back({crossed[i][0], crossed[i][1], crossed[i + 1][0], crossed[i + 1][1]});
}

/// The dose in the plane z, at the grid's points in x and y.
std::vector<double> plane_of(const DoseGrid& dose, double z) {
  const auto [nx, ny, nz] = dose.size();
  std::vector<double> gy;
  for (std::size_t j = 0; j < ny; ++j)
    for (std::size_t i = 0; i < nx; ++i) {
      Vec3 p = dose.position(i, j, 0);
      p.z() = z;
      gy.push_back(dose.at(p));
    }
  return gy;
}

OutlinePieces isodose(const DoseGrid& dose, const std::vector<double>& plane, double level_gy) {
  OutlinePieces pieces;
  const auto [nx, ny, nz] = dose.size();
  for (std::size_t j = 0; j + 1 < ny; ++j)
    for (std::size_t i = 0; i + 1 < nx; ++i) {
      std::array<double, 4> gy{};
      std::array<Point, 4> at{};
      constexpr std::array<std::array<std::size_t, 2>, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
      for (std::size_t c = 0; c < 4; ++c) {
        const std::size_t x = i + kCorners[c][0], y = j + kCorners[c][1];
        gy[c] = plane[y * nx + x];
        const Vec3 p = dose.position(x, y, 0);
        at[c] = {p.x(), p.y()};
      }
      add_square(gy, at, level_gy, pieces);
    }
  return pieces;
}

}  // namespace

std::vector<AxialSlice> axial_slices(const std::vector<Structure>& structures, const DoseGrid& dose,
                                     double prescription_gy) {
  const std::vector<Vec3>& vertices = structures.front().mesh.vertices;
  const auto [low, high] = std::ranges::minmax_element(vertices, {}, [](const Vec3& v) { return v.z(); });
  std::vector<AxialSlice> slices;
  const double first = std::ceil(low->z() / kSliceSpacingMm) * kSliceSpacingMm;
  for (double z = first; z <= high->z(); z += kSliceSpacingMm) {
    AxialSlice slice{.z_mm = z, .structures = {}, .isodoses = {}};
    const std::vector<double> plane = plane_of(dose, z);
    for (const Structure& structure : structures)
      if (OutlinePieces pieces = cut(structure.mesh, slice.z_mm); !pieces.empty())
        slice.structures.push_back({structure.name, std::move(pieces)});
    for (std::size_t level = 0; level < kIsodosePercent.size(); ++level)
      slice.isodoses[level] = isodose(dose, plane, prescription_gy * kIsodosePercent[level] / 100);
    slices.push_back(std::move(slice));
  }
  return slices;
}

}  // namespace brachy
