#include "core/brachytherapy/dose/structure_voxels.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace brachy {
namespace {

// Cubes side by side: a grid's voxels, or pieces of them.
struct Cells {
  Vec3 first;  // centre of cell (0, 0, 0)
  double side;
  std::array<std::size_t, 3> size;

  Vec3 centre(std::size_t i, std::size_t j, std::size_t k) const {
    return first + side * Vec3(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
  }
};

Cells cells_of(const DoseGrid& grid, std::size_t cuts) {
  const double side = grid.spacing_mm() / static_cast<double>(cuts);
  const auto [nx, ny, nz] = grid.size();
  return {grid.origin() - Vec3::Constant((grid.spacing_mm() - side) / 2),
          side,
          {nx * cuts, ny * cuts, nz * cuts}};
}

// Of the rays through a cell: their length inside, and its first moments about the cell's centre; in cell sides.
struct Inside {
  double length = 0;
  Vec3 moment = Vec3::Zero();
};

// Adds the part inside the surface of the ray that is (dx, dy) sides from the column's centre line.
void add_ray(const SurfaceBvh& surface, const Cells& cells, const Vec3& first, double dx, double dy,
             std::vector<Inside>& column) {
  constexpr std::size_t kMaxHits = 256;
  std::array<SurfaceHit, kMaxHits> hits;
  const double h = cells.side, x = first.x() + h * dx, y = first.y() + h * dy, bottom = first.z() - h / 2;
  const std::size_t count =
      surface.all_hits({x, y, surface.min().z() - 1}, {x, y, surface.max().z() + 1}, hits);
  int depth = 0;
  double from = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double at = (hits[i].point.z() - bottom) / h;
    if (hits[i].entering) {
      if (depth++ == 0) from = std::max(at, 0.0);
      continue;
    }
    if (--depth != 0) continue;
    const double to = std::min(at, static_cast<double>(column.size()));
    for (auto k = static_cast<std::size_t>(from); static_cast<double>(k) < to; ++k) {
      const double lower = std::max(from - static_cast<double>(k), 0.0),
                   upper = std::min(to - static_cast<double>(k), 1.0);
      column[k].length += upper - lower;
      column[k].moment += (upper - lower) * Vec3(dx, dy, (lower + upper) / 2 - 0.5);
    }
  }
}

// Calls visit(i, j, k, share, centre) for each cell with something inside: its share of the cell and its centre.
template <class Visit>
void visit_cells(const SurfaceBvh& surface, const Cells& cells, const Visit& visit) {
  // of a cell: rounding leaves this of a cell that only touches the surface
  constexpr double kNothing = 1e-6;
  const double h = cells.side;
  const int rays = static_cast<int>(std::max(4.0, std::ceil(h / kRaySpacingMm)));
  std::vector<Inside> column(cells.size[2]);
  for (std::size_t j = 0; j < cells.size[1]; ++j)
    for (std::size_t i = 0; i < cells.size[0]; ++i) {
      const Vec3 first = cells.centre(i, j, 0);
      if (first.x() + h < surface.min().x() || first.x() - h > surface.max().x() ||
          first.y() + h < surface.min().y() || first.y() - h > surface.max().y())
        continue;
      std::fill(column.begin(), column.end(), Inside{});
      for (int y = 0; y < rays; ++y)
        for (int x = 0; x < rays; ++x)
          add_ray(surface, cells, first, (x + 0.5) / rays - 0.5, (y + 0.5) / rays - 0.5, column);
      for (std::size_t k = 0; k < column.size(); ++k) {
        const double share = column[k].length / (rays * rays);
        if (share < kNothing) continue;
        const bool is_whole = share > 1 - kNothing;
        visit(i, j, k, is_whole ? 1 : share,
              is_whole ? cells.centre(i, j, k)
                       : cells.centre(i, j, k) + h / column[k].length * column[k].moment);
      }
    }
}

}  // namespace

StructureVoxels structure_voxels(const SurfaceBvh& surface, const DoseGrid& grid) {
  StructureVoxels voxels;
  const double voxel_mm3 = std::pow(grid.spacing_mm(), 3);
  double filled = 0;
  visit_cells(surface, cells_of(grid, 1), [&](auto i, auto j, auto k, double share, const Vec3& centre) {
    filled += share;
    if (share == 1)
      voxels.whole.push_back(static_cast<std::uint32_t>(grid.index(i, j, k)));
    else
      voxels.parts.push_back({centre, share * voxel_mm3});
  });
  std::sort(voxels.whole.begin(), voxels.whole.end());
  voxels.volume_cc = filled * voxel_mm3 / 1000;
  if (filled == 0 || filled >= kPieces) return voxels;

  voxels = {};
  const Cells pieces =
      cells_of(grid, static_cast<std::size_t>(std::min(std::ceil(std::cbrt(kPieces / filled)), kFinest)));
  const double piece_mm3 = std::pow(pieces.side, 3);
  visit_cells(surface, pieces, [&](auto, auto, auto, double share, const Vec3& centre) {
    voxels.parts.push_back({centre, share * piece_mm3});
    voxels.volume_cc += share * piece_mm3 / 1000;
  });
  return voxels;
}

}  // namespace brachy
