#include "core/tissue/region.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/surface/surface_bvh.h"

namespace brachy {
namespace {

constexpr double kOnSurface = 1e-4;  // of a region's size
constexpr double kAtSurface =
    1e-9;  // the same, where the difference to the nearest point has no direction left

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

double EllipsoidRegion::signed_distance(const Vec3& X, Vec3* gradient) const noexcept {
  const Vec3 y = (X - centre_).cwiseQuotient(semi_axes_), z = y.cwiseQuotient(semi_axes_);
  const double k = y.norm(), slope = z.norm();
  if (!(slope > 0)) {
    if (gradient) gradient->setZero();
    return -semi_axes_.minCoeff();
  }
  const double distance = k * (k - 1) / slope;
  if (gradient) {
    const Vec3 slope_gradient = z.cwiseQuotient(semi_axes_).cwiseQuotient(semi_axes_) / slope;
    *gradient = ((2 * k - 1) / k * z - distance * slope_gradient) / slope;
  }
  return distance;
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

double MeshRegion::signed_distance(const Vec3& X, Vec3* gradient) const noexcept {
  const ClosestPoint nearest = impl_->bvh.closest_point(X);
  const double distance = nearest.signed_distance;
  if (gradient)
    *gradient =
        std::abs(distance) > kAtSurface * impl_->size ? Vec3((X - nearest.point) / distance) : nearest.normal;
  return distance;
}

std::vector<SurfacePatch> MeshRegion::surface(std::size_t n) const {
  return patches_of(impl_->mesh, n);
}

}  // namespace brachy
