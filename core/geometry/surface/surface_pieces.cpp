#include "core/geometry/surface/surface_pieces.h"

#include <cmath>
#include <numbers>
#include <numeric>
#include <span>

#include "core/base/error.h"

namespace brachy {
namespace {

double volume6(const Vec3& a, const Vec3& b, const Vec3& c) {
  return a.dot(b.cross(c));
}

/// The winding number of `triangles` about p: solid angles by van Oosterom, Strackee (1983).
double winding_number(const SurfaceMesh& mesh, std::span<const std::uint32_t> triangles, const Vec3& p) {
  double half_angles = 0;
  for (const std::uint32_t t : triangles) {
    const Triangle& corner = mesh.triangles[t];
    const Vec3 x = mesh.vertices[corner[0]] - p, y = mesh.vertices[corner[1]] - p,
               z = mesh.vertices[corner[2]] - p;
    const double nx = x.norm(), ny = y.norm(), nz = z.norm();
    half_angles += std::atan2(volume6(x, y, z), nx * ny * nz + x.dot(y) * nz + y.dot(z) * nx + z.dot(x) * ny);
  }
  return half_angles / (2 * std::numbers::pi);
}

/// The triangles of each component, ascending.
struct TrianglesOfPieces {
  TrianglesOfPieces(const std::vector<std::uint32_t>& component, std::size_t count)
      : first(count + 1, 0), triangles(component.size()) {
    for (const std::uint32_t c : component) ++first[c + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (std::size_t t = 0; t < component.size(); ++t)
      triangles[next[component[t]]++] = static_cast<std::uint32_t>(t);
  }
  std::span<const std::uint32_t> of(std::size_t c) const {
    return std::span(triangles).subspan(first[c], first[c + 1] - first[c]);
  }

  std::vector<std::size_t> first;
  std::vector<std::uint32_t> triangles;
};

}  // namespace

std::vector<Piece> measure_pieces(const SurfaceMesh& mesh, const std::vector<std::uint32_t>& label,
                                  std::size_t count) {
  std::vector<Piece> pieces(count);
  for (std::size_t t = 0; t < label.size(); ++t) {
    Piece& piece = pieces[label[t]];
    ++piece.triangles;
    for (const std::uint32_t v : mesh.triangles[t]) piece.centre += mesh.vertices[v];
  }
  for (Piece& piece : pieces) piece.centre /= 3.0 * static_cast<double>(piece.triangles);
  for (std::size_t t = 0; t < label.size(); ++t) {
    Piece& piece = pieces[label[t]];
    const Triangle& c = mesh.triangles[t];
    const Vec3 a = mesh.vertices[c[0]] - piece.centre, b = mesh.vertices[c[1]] - piece.centre,
               d = mesh.vertices[c[2]] - piece.centre;
    piece.volume += volume6(a, b, d) / 6;
    piece.area += (b - a).cross(d - a).norm() / 2;
  }
  return pieces;
}

std::vector<bool> choose_kept(const std::vector<Piece>& pieces, const SurfaceTopology& topology,
                              double min_share) {
  std::vector<double> size(pieces.size());
  double total = 0, islands = 0;
  for (std::size_t c = 0; c < pieces.size(); ++c) {
    const double area = pieces[c].area;
    size[c] = topology.edges[c].bad() == 0 ? std::abs(pieces[c].volume)
                                           : area * std::sqrt(area / std::numbers::pi) / 6;  // of a sphere
    total += size[c];
  }
  std::vector<bool> kept(pieces.size());
  for (std::size_t c = 0; c < pieces.size(); ++c) {
    kept[c] = !(size[c] < min_share * total);  // an overflow to NaN keeps it
    if (!kept[c]) islands += size[c];
  }
  if (islands > total / 10) kept.assign(pieces.size(), true);
  return kept;
}

std::vector<bool> find_cavities(const SurfaceMesh& mesh, const SurfaceTopology& topology,
                                const std::vector<bool>& kept, const std::string& name) {
  const std::size_t count = topology.component_count;
  std::vector<bool> cavity(count, false);
  std::vector<Vec3> min(count, Vec3::Constant(1e300)), max(count, Vec3::Constant(-1e300)), vertex(count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      const std::uint32_t c = topology.component[t];
      min[c] = min[c].cwiseMin(mesh.vertices[v]);
      max[c] = max[c].cwiseMax(mesh.vertices[v]);
      vertex[c] = mesh.vertices[v];
    }
  }
  std::vector<std::size_t> closed;
  for (std::size_t c = 0; c < count; ++c)
    if (kept[c] && topology.edges[c].bad() == 0) closed.push_back(c);
  const auto refuse = [&](const std::string& what) {
    throw UserError(name + ": " + what + "; remove pieces, or export the organ as one closed surface");
  };
  if (closed.size() > kMaxClosedPieces)
    refuse("consists of " + std::to_string(closed.size()) + " separate pieces, more than " +
           std::to_string(kMaxClosedPieces));
  const TrianglesOfPieces pieces(topology.component, count);
  std::size_t work = 0;
  for (const std::size_t inner : closed) {
    for (const std::size_t outer : closed) {
      if (outer == inner) continue;
      if ((min[inner].array() < min[outer].array()).any() || (max[inner].array() > max[outer].array()).any())
        continue;
      work += pieces.of(outer).size();
      if (work > kMaxCavityWork)
        refuse(
            "has too many closed pieces within others to tell cavities from solid parts in reasonable time");
      if (winding_number(mesh, pieces.of(outer), vertex[inner]) > 0.5) cavity[inner] = !cavity[inner];
    }
  }
  return cavity;
}

}  // namespace brachy
