#include "core/geometry/surface/plane_section.h"

#include <map>
#include <utility>

namespace brachy {

std::vector<PlaneEdge> plane_section(const SurfaceMesh& mesh, const RigidTransform& X_WS) {
  const RigidTransform X_SW = X_WS.inverse();
  std::vector<Vec3> vertices;
  vertices.reserve(mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) vertices.push_back(X_SW * v);
  std::vector<PlaneEdge> edges;
  for (const Triangle& t : mesh.triangles) {
    PlaneEdge edge;
    std::size_t ends = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t a = t[k], b = t[(k + 1) % 3];
      // A vertex in the plane counts as above it, so that every triangle is crossed twice or not at all; and both
      // triangles at an edge find the same point to the bit.
      if ((vertices[a].z() >= 0) == (vertices[b].z() >= 0)) continue;
      if (a > b) std::swap(a, b);
      const Vec3 &p = vertices[a], &q = vertices[b];
      edge[ends++] = (p + p.z() / (p.z() - q.z()) * (q - p)).head<2>();
    }
    if (ends == 2 && edge[0] != edge[1]) edges.push_back(edge);
  }
  return edges;
}

std::vector<std::vector<Vec2>> outlines_of(std::span<const PlaneEdge> edges) {
  // Both edges at a point have it to the bit.
  std::multimap<std::pair<double, double>, std::size_t> at;
  for (std::size_t e = 0; e < edges.size(); ++e)
    for (const Vec2& end : edges[e]) at.emplace(std::pair(end.x(), end.y()), e);
  std::vector<bool> is_used(edges.size());
  std::vector<std::vector<Vec2>> outlines;
  for (std::size_t first = 0; first < edges.size(); ++first) {
    if (is_used[first]) continue;
    std::vector<Vec2> outline;
    Vec2 end = edges[first][1];
    for (std::size_t e = first; e < edges.size();) {
      is_used[e] = true;
      outline.push_back(end);
      std::size_t next = edges.size();
      const auto [begin, stop] = at.equal_range({end.x(), end.y()});
      for (auto it = begin; it != stop && next == edges.size(); ++it)
        if (!is_used[it->second]) next = it->second;
      if (next < edges.size()) end = edges[next][edges[next][0] == end ? 1 : 0];
      e = next;
    }
    if (outline.size() > 2 && outline.back() == edges[first][0]) outlines.push_back(std::move(outline));
  }
  return outlines;
}

}  // namespace brachy
