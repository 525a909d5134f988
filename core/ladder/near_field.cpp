#include "core/ladder/near_field.h"

#include <numbers>

#include "core/elastic/kelvin.h"

namespace brachy {
namespace {

double squared_distance(const Vec3& p, const Block& box) {
  return (box.min - p).cwiseMax(p - box.max).cwiseMax(0.0).squaredNorm();
}

}  // namespace

CompactShape shape_of(const CompactKernel& kernel) {
  CompactShape shape;
  for (const CompactTerm& term : kernel.terms()) {
    shape.inverse_radius[shape.count] = static_cast<float>(1 / term.support);
    shape.w[shape.count] = static_cast<float>(term.w);
    shape.v[shape.count++] = static_cast<float>(term.v);
  }
  return shape;
}

NearField::NearField(const Tissue& tissue, double scale, double needle_radius, SimdTarget target)
    : tissue_(tissue),
      scale_(scale),
      far_distance_(kFarRadii * needle_radius),
      loops_(near_loops(target)),
      blocks_(tissue) {}

NearField::NearField(const Tissue& tissue, const ElasticKernel& kernel, double weight, SimdTarget target)
    : NearField(tissue, weight / kernel.body().shear_modulus, kernel.body().needle_radius, target) {
  elastic_ = &kernel;
}

NearField::NearField(const Tissue& tissue, const CompactKernel& kernel, double needle_radius,
                     SimdTarget target)
    : NearField(tissue, kernel.compliance(), needle_radius, target) {
  compact_ = &kernel;
  shape_ = shape_of(kernel);
}

Mat3 NearField::value(const Vec3& x, double s) const noexcept {
  return elastic_ ? Mat3(scale_ * kelvin(x, s, elastic_->body().poisson)) : compact_->value(x);
}

Mat3 NearField::between(const NeedleRings& rings, const NeedleRings::Ring& a,
                        const NeedleRings::Ring& b) const noexcept {
  const bool is_far = (a.centre - b.centre).squaredNorm() > far_distance_ * far_distance_;
  if ((a.count == 1 && b.count == 1) || is_far) return value(a.centre - b.centre, a.s + b.s);
  Mat3 sum = Mat3::Zero();
  for (const Vec3& p : rings.points(a))
    for (const Vec3& q : rings.points(b)) sum += value(p - q, a.s + b.s);
  return sum / static_cast<double>(a.count * b.count);
}

void NearField::add_to_block(std::uint32_t b, const NeedleRings& rings, std::span<const Vec3> ring_forces,
                             std::vector<NearSource>& sources, BlockDisplacement<float>& u) const noexcept {
  const Vec3& centre = blocks_.centres[b];
  const double scale = elastic_ ? scale_ / (4 * std::numbers::pi) : scale_;
  sources.clear();
  const auto add = [&](const Vec3& at, double s, const Vec3& f) {
    const Eigen::Vector3f p = (at - centre).cast<float>(), g = (scale * f).cast<float>();
    sources.push_back({p.x(), p.y(), p.z(), static_cast<float>(s), g.x(), g.y(), g.z(), 0});
  };
  for (std::size_t r = 0; r < ring_forces.size(); ++r) {
    const NeedleRings::Ring& ring = rings.rings()[r];
    if (ring.count == 1 || squared_distance(ring.centre, tissue_.blocks[b]) > far_distance_ * far_distance_) {
      add(ring.centre, ring.s, ring_forces[r]);
    } else {
      for (const Vec3& p : rings.points(ring))
        add(p, ring.s, ring_forces[r] / static_cast<double>(ring.count));
    }
  }
  if (elastic_)
    loops_.kelvin(blocks_.points[b], sources.data(), sources.size(),
                  static_cast<float>(1 / (4 * (1 - elastic_->body().poisson))), u);
  else
    loops_.compact(blocks_.points[b], sources.data(), sources.size(), shape_, u);
}

Vec3 NearField::displacement_at(const Vec3& X, const NeedleRings& rings,
                                std::span<const Vec3> ring_forces) const noexcept {
  Vec3 u = Vec3::Zero();
  for (std::size_t r = 0; r < ring_forces.size(); ++r) {
    const NeedleRings::Ring& ring = rings.rings()[r];
    for (const Vec3& p : rings.points(ring))
      u += value(X - p, ring.s) * ring_forces[r] / static_cast<double>(ring.count);
  }
  return u;
}

}  // namespace brachy
