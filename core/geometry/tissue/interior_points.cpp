#include "core/geometry/tissue/interior_points.h"

#include <array>

#include "core/base/error.h"

namespace brachy {
namespace {

/// 2⁶⁴ g⁻¹, 2⁶⁴ g⁻², 2⁶⁴ g⁻³ with g = 1.22074408460575947536…, the root of g⁴ = g + 1.
constexpr std::array<std::uint64_t, 3> kStep = {0xD1B54A32D192ED03u, 0xABC98388FB8FAC02u,
                                                0x8CB92BA72F3D8DD7u};

/// The next number of splitmix64 (Steele, Lea, Flood 2014).
std::uint64_t next_random(std::uint64_t& state) {
  std::uint64_t z = state += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}

}  // namespace

std::vector<Vec3> fill_interior(const SurfaceBvh& surface, std::size_t count, std::uint64_t seed,
                                const std::string& name) {
  if (count > kMaxInteriorPoints) {
    throw UserError(name + ": " + std::to_string(count) + " interior points are more than the limit of " +
                    std::to_string(kMaxInteriorPoints) + "; ask for fewer");
  }
  std::vector<Vec3> points;
  points.reserve(count);
  std::array<std::uint64_t, 3> place;
  for (std::uint64_t& p : place) p = next_random(seed);
  const Vec3 size = surface.max() - surface.min();
  const std::uint64_t tries = 10'000 + 1'000 * std::uint64_t{count};
  for (std::uint64_t i = 0; points.size() < count; ++i) {
    if (i == tries) {
      throw UserError(name + ": it fills almost none of its bounding box (" + std::to_string(points.size()) +
                      " of " + std::to_string(i) + " points lie inside), so " + std::to_string(count) +
                      " interior points cannot be placed; check the surface, or keep only the organ");
    }
    Vec3 p;
    for (std::size_t k = 0; k < 3; ++k) {
      place[k] += kStep[k];  // modulo 1, exactly
      const auto axis = static_cast<int>(k);
      p[axis] = surface.min()[axis] + size[axis] * (static_cast<double>(place[k] >> 11) * 0x1p-53);
    }
    if (surface.inside(p)) points.push_back(p);
  }
  return points;
}

}  // namespace brachy
