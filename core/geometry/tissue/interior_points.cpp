#include "core/geometry/tissue/interior_points.h"

#include "core/base/error.h"
#include "core/base/even_places.h"

namespace brachy {
std::vector<Vec3> fill_interior(const SurfaceBvh& surface, std::size_t count, std::uint64_t seed,
                                const std::string& name) {
  if (count > kMaxInteriorPoints) {
    throw UserError(name + ": " + std::to_string(count) + " interior points are more than the limit of " +
                    std::to_string(kMaxInteriorPoints) + "; ask for fewer");
  }
  std::vector<Vec3> points;
  points.reserve(count);
  EvenPlaces places(seed);
  const Vec3 size = surface.max() - surface.min();
  const std::uint64_t tries = 10'000 + 1'000 * std::uint64_t{count};
  for (std::uint64_t i = 0; points.size() < count; ++i) {
    if (i == tries) {
      throw UserError(name + ": it fills almost none of its bounding box (" + std::to_string(points.size()) +
                      " of " + std::to_string(i) + " points lie inside), so " + std::to_string(count) +
                      " interior points cannot be placed; check the surface, or keep only the organ");
    }
    const Vec3 p = surface.min() + size.cwiseProduct(places.next());
    if (surface.inside(p)) points.push_back(p);
  }
  return points;
}

}  // namespace brachy
