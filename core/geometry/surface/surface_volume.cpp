#include "core/geometry/surface/surface_volume.h"

#include <algorithm>
#include <cmath>

namespace brachy {
namespace {

std::vector<Vec3> unit_normals(const SurfaceMesh& mesh) {
  std::vector<Vec3> normals(mesh.vertices.size(), Vec3::Zero());
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto& v = mesh.vertices;
    const Vec3 n = (v[b] - v[a]).cross(v[c] - v[a]);
    for (const auto corner : {a, b, c}) normals[corner] += n;
  }
  for (Vec3& n : normals) n = n.norm() > 0 ? n.normalized() : Vec3::Zero();
  return normals;
}

double area_mm2(const SurfaceMesh& mesh) {
  double twice = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    twice += (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  return 0.5 * twice;
}

}  // namespace

double enclosed_mm3(const SurfaceMesh& mesh) {
  double six = 0;
  if (mesh.vertices.empty()) return 0;
  const Vec3 origin = mesh.vertices.front();  // keeps digits far from the world's origin
  for (const auto& [a, b, c] : mesh.triangles)
    six += (mesh.vertices[a] - origin).dot((mesh.vertices[b] - origin).cross(mesh.vertices[c] - origin));
  return six / 6;
}

Vec3 enclosed_centroid(const SurfaceMesh& mesh) {
  if (mesh.vertices.empty()) return Vec3::Zero();
  const Vec3 from = mesh.vertices.front();
  double six = 0;
  Vec3 sum = Vec3::Zero();
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    const Vec3 a = mesh.vertices[ia] - from, b = mesh.vertices[ib] - from, c = mesh.vertices[ic] - from;
    const double volume = a.dot(b.cross(c));
    six += volume;
    sum += volume * 0.25 * (a + b + c);
  }
  return std::abs(six) > 0 ? Vec3(from + sum / six) : from;
}

void move_to_volume(SurfaceMesh& mesh, double volume_mm3, double most_mm) {
  // The volume grows by nearly distance × area; what is left of the difference shrinks with each round.
  const std::vector<Vec3> normals = unit_normals(mesh);
  double moved_mm = 0;
  for (int round = 0; round < 6; ++round) {
    const double missing = volume_mm3 - enclosed_mm3(mesh);
    if (std::abs(missing) <= 1e-3 * volume_mm3) return;
    const double step = std::clamp(missing / area_mm2(mesh), -most_mm - moved_mm, most_mm - moved_mm);
    moved_mm += step;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) mesh.vertices[v] += step * normals[v];
  }
}

SurfaceMesh with_margins(const SurfaceMesh& mesh, const Margins& margins) {
  SurfaceMesh wider = mesh;
  const std::vector<Vec3> normals = unit_normals(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3& n = normals[v];
    const Vec3 axes(margins.mm, n.y() < 0 ? margins.posterior_mm : margins.mm, margins.mm);
    const Vec3 scaled = axes.cwiseProduct(n);
    if (scaled.norm() > 0) wider.vertices[v] += axes.cwiseProduct(scaled) / scaled.norm();
  }
  return wider;
}

}  // namespace brachy
