#include "core/elasticity/elastic_body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/geometry/surface/surface_bvh.h"

namespace brachy {
namespace {

constexpr double kOnSurface = 1e-4;  // of a region's size

// n patches of a mesh's surface: triangles gathered to the nearest of n seeds, each seed the vertex farthest from those
// before it. Deterministic, and even wherever the mesh is.
std::vector<SurfacePatch> patches_of(const SurfaceMesh& mesh, std::size_t n) {
  std::vector<Vec3> seeds;
  std::vector<double> distance(mesh.vertices.size(), std::numeric_limits<double>::max());
  std::size_t next = 0;
  while (seeds.size() < std::min(n, mesh.vertices.size())) {
    seeds.push_back(mesh.vertices[next]);
    for (std::size_t v = 0; v < distance.size(); ++v)
      distance[v] = std::min(distance[v], (mesh.vertices[v] - seeds.back()).squaredNorm());
    next = static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
  }
  std::vector<Vec3> moment(seeds.size(), Vec3::Zero()), normal(seeds.size(), Vec3::Zero());
  std::vector<double> area(seeds.size());
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3 centre = (a + b + c) / 3, n2 = 0.5 * (b - a).cross(c - a);
    const auto nearest = std::min_element(seeds.begin(), seeds.end(), [&](const Vec3& p, const Vec3& q) {
      return (p - centre).squaredNorm() < (q - centre).squaredNorm();
    });
    const auto s = static_cast<std::size_t>(nearest - seeds.begin());
    moment[s] += n2.norm() * centre;
    normal[s] += n2;
    area[s] += n2.norm();
  }
  std::vector<SurfacePatch> patches;
  for (std::size_t s = 0; s < seeds.size(); ++s)
    if (area[s] > 0 && normal[s].norm() > 0)
      patches.push_back({moment[s] / area[s], normal[s].normalized(), area[s]});
  return patches;
}

}  // namespace

EllipsoidRegion::EllipsoidRegion(const Vec3& centre, const Vec3& semi_axes, double modulus)
    : centre_(centre), semi_axes_(semi_axes) {
  shear_modulus = modulus;
}

double EllipsoidRegion::inside_share(const Vec3& X) const {
  const double q = (X - centre_).cwiseQuotient(semi_axes_).squaredNorm();
  return std::abs(q - 1) < kOnSurface ? 0.5 : q < 1 ? 1 : 0;
}

// A spiral of equal areas on the unit sphere, stretched; the area of a patch by the stretch of its normal.
std::vector<SurfacePatch> EllipsoidRegion::surface(std::size_t n) const {
  std::vector<SurfacePatch> patches;
  const double share = 4 * std::numbers::pi / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double k = static_cast<double>(i) + 0.5, z = 1 - 2 * k / static_cast<double>(n);
    const double turn = std::numbers::pi * (1 + std::sqrt(5.0)) * k, r = std::sqrt(1 - z * z);
    const Vec3 u(r * std::cos(turn), r * std::sin(turn), z), scaled = u.cwiseQuotient(semi_axes_);
    patches.push_back({centre_ + u.cwiseProduct(semi_axes_), scaled.normalized(),
                       share * semi_axes_.prod() * scaled.norm()});
  }
  return patches;
}

struct MeshRegion::Impl {
  explicit Impl(SurfaceMesh m) : mesh(std::move(m)), bvh(mesh) {
    Vec3 min = mesh.vertices.front(), max = min;
    for (const Vec3& v : mesh.vertices) {
      min = min.cwiseMin(v);
      max = max.cwiseMax(v);
    }
    size = (max - min).maxCoeff();
  }
  SurfaceMesh mesh;
  SurfaceBvh bvh;
  double size;
};

MeshRegion::MeshRegion(SurfaceMesh surface, double modulus)
    : impl_(std::make_unique<Impl>(std::move(surface))) {
  shear_modulus = modulus;
}
MeshRegion::~MeshRegion() = default;

double MeshRegion::inside_share(const Vec3& X) const {
  if ((impl_->bvh.closest_point(X).point - X).norm() < kOnSurface * impl_->size) return 0.5;
  return impl_->bvh.inside(X) ? 1 : 0;
}

std::vector<SurfacePatch> MeshRegion::surface(std::size_t n) const {
  return patches_of(impl_->mesh, n);
}

std::vector<double> ElasticBody::materials() const {
  std::vector<double> k = {1};
  for (const auto& region : regions) k.push_back(region->shear_modulus / shear_modulus);
  return k;
}

void ElasticBody::material_shares(const Vec3& X, std::span<double> shares) const {
  std::ranges::fill(shares, 0);
  double left = 1;
  for (std::size_t r = regions.size(); r > 0 && left > 0; --r) {
    shares[r] = left * regions[r - 1]->inside_share(X);
    left -= shares[r];
  }
  shares[0] = left;
}

double ElasticBody::relative_modulus(const Vec3& X) const {
  double left = 1, modulus = 0;
  for (std::size_t r = regions.size(); r > 0 && left > 0; --r) {
    const double share = left * regions[r - 1]->inside_share(X);
    modulus += share * regions[r - 1]->shear_modulus / shear_modulus;
    left -= share;
  }
  return modulus + left;
}

Vec3 ElasticBody::face_normal(std::size_t f) {
  return (f % 2 ? 1.0 : -1.0) * Vec3::Unit(static_cast<Eigen::Index>(f / 2));
}

Vec3 ElasticBody::face_centre(std::size_t f) const {
  return box_centre + 0.5 * box_size.cwiseProduct(face_normal(f));
}

}  // namespace brachy
