#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/surface/surface_topology.h"

namespace brachy {

/// Measures of a part of a surface.
struct Piece {
  std::size_t triangles = 0;
  Vec3 centre = Vec3::Zero();  ///< mean of the corners
  double volume = 0;           ///< mm³, signed, seen from the centre
  double area = 0;             ///< mm²
};

/// Measures each component or patch; `label` is its number for each triangle.
std::vector<Piece> measure_pieces(const SurfaceMesh& mesh, const std::vector<std::uint32_t>& label,
                                  std::size_t count);

/// Which components are kept: those of at least `min_share` of the total size; all of them if the others together make
/// up more than a tenth. Size is |volume|, or for an open component that of the sphere of its area.
std::vector<bool> choose_kept(const std::vector<Piece>& components, const SurfaceTopology& topology,
                              double min_share);

/// The kept closed components that lie within an odd number of other kept closed ones. All must be wound outward,
/// each on its own. Compares a piece with all triangles of each piece whose box holds its own: UserError, which begins
/// with `name`, beyond the limits below, a few seconds of one core.
std::vector<bool> find_cavities(const SurfaceMesh& mesh, const SurfaceTopology& topology,
                                const std::vector<bool>& kept, const std::string& name);

inline constexpr std::size_t kMaxClosedPieces = 10'000;
inline constexpr std::size_t kMaxCavityWork = 30'000'000;  ///< solid angles of triangles

}  // namespace brachy
