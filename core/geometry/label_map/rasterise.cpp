#include "core/geometry/label_map/rasterise.h"

#include <array>

namespace brachy {

std::size_t rasterise(const SurfaceBvh& surface, const VoxelGrid& grid, std::uint16_t value,
                      std::vector<std::uint16_t>& labels) {
  std::size_t set = 0;
  std::array<SurfaceHit, 256> hits;
  const auto [nx, ny, nz] = grid.size;
  for (std::size_t k = 0; k < nz; ++k)
    for (std::size_t j = 0; j < ny; ++j) {
      const Vec3 from = grid.position(Vec3(-1, static_cast<double>(j), static_cast<double>(k)));
      const Vec3 to = from + (static_cast<double>(nx) + 1) * grid.steps.col(0);
      const std::size_t count = surface.all_hits(from, to, hits);
      // A row that starts within the surface has an exit first.
      bool is_inside = count > 0 && !hits[0].entering;
      std::size_t next = 0;
      for (std::size_t i = 0; i < nx; ++i) {
        const double t = static_cast<double>(i + 1) / static_cast<double>(nx + 1);
        for (; next < count && hits[next].t <= t; ++next) is_inside = hits[next].entering;
        if (!is_inside) continue;
        labels[grid.index(i, j, k)] = value;
        ++set;
      }
    }
  return set;
}

}  // namespace brachy
