#include "core/geometry/surface/plane_section.h"

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

}  // namespace brachy
