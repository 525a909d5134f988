#include "core/models/matrix_kernel/near_field.h"

#include <limits>
#include <numbers>

#include "core/elasticity/kelvin.h"
#include "core/elasticity/landmark_stiffness.h"

namespace brachy {

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
  kelvin_b_ = static_cast<float>(1 / (4 * (1 - kernel.body().poisson)));
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
  const double s = &a == &b && a.count == 1 ? a.core.self_s : a.core.s + b.core.s;
  if ((a.count == 1 && b.count == 1) || is_far) return value(a.centre - b.centre, s);
  Mat3 sum = Mat3::Zero();
  for (const Vec3& p : rings.points(a))
    for (const Vec3& q : rings.points(b)) sum += value(p - q, s);
  return sum / static_cast<double>(a.count * b.count);
}

void NearField::add_sources(const NeedleRings& rings, const NeedleRings::Ring& ring, bool as_one,
                            const Vec3& force, const Vec3& centre,
                            std::vector<NearSource>& sources) const noexcept {
  const double scale = elastic_ ? scale_ / (4 * std::numbers::pi) : scale_;
  const auto add = [&](const Vec3& at, double s, const Vec3& f) {
    const Eigen::Vector3f p = (at - centre).cast<float>(), g = (scale * f).cast<float>();
    sources.push_back({p.x(), p.y(), p.z(), static_cast<float>(s), g.x(), g.y(), g.z(), 0});
  };
  if (as_one) return add(ring.centre, ring.core.s, force);
  for (const Vec3& p : rings.points(ring)) add(p, ring.core.s, force / static_cast<double>(ring.count));
}

void NearField::add_to_block(std::uint32_t b, const NeedleRings& rings, std::span<const Vec3> ring_forces,
                             std::vector<NearSource>& sources, BlockDisplacement<float>& u) const noexcept {
  sources.clear();
  for (std::size_t r = 0; r < ring_forces.size(); ++r) {
    const NeedleRings::Ring& ring = rings.rings()[r];
    const bool as_one =
        ring.count == 1 || tissue_.blocks[b].squared_distance(ring.centre) > far_distance_ * far_distance_;
    add_sources(rings, ring, as_one, ring_forces[r], blocks_.centres[b], sources);
  }
  if (elastic_)
    loops_.kelvin(blocks_.points[b], sources.data(), sources.size(), kelvin_b_, u);
  else
    loops_.compact(blocks_.points[b], sources.data(), sources.size(), shape_, u);
}

double NearField::compliance_times_core() const {
  const double poisson = elastic_->body().poisson;
  return scale_ / elastic_landmark_stiffness(1, poisson, 1);
}

double NearField::reach() const {
  return elastic_ ? std::numeric_limits<double>::infinity() : compact_->support();
}

NearBounds NearField::bounds() const {
  // The compact kernel's gradient has its compliance in it already.
  return elastic_ ? NearBounds(elastic_->body().poisson) : NearBounds(*compact_, 1 / compact_->compliance());
}

void NearField::add_gradients(const CellPoints& X, std::span<const NearSource> sources,
                              CellGradients& A) const noexcept {
  if (elastic_)
    loops_.kelvin_gradients(X, sources.data(), sources.size(), kelvin_b_, A);
  else
    loops_.compact_gradients(X, sources.data(), sources.size(), shape_, A);
}

Mat3 NearField::gradient_at(const Vec3& X, const NeedleRings& rings,
                            std::span<const Vec3> ring_forces) const noexcept {
  Mat3 A = Mat3::Zero();
  for (std::size_t r = 0; r < ring_forces.size(); ++r) {
    const NeedleRings::Ring& ring = rings.rings()[r];
    const Vec3 force = ring_forces[r] / static_cast<double>(ring.count);
    for (const Vec3& p : rings.points(ring))
      A += elastic_ ? Mat3(scale_ * kelvin_gradient(X - p, ring.core.s, elastic_->body().poisson, force))
                    : compact_->gradient(X - p, force);
  }
  return A;
}

Vec3 NearField::displacement_at(const Vec3& X, const NeedleRings& rings,
                                std::span<const Vec3> ring_forces) const noexcept {
  Vec3 u = Vec3::Zero();
  for (std::size_t r = 0; r < ring_forces.size(); ++r) {
    const NeedleRings::Ring& ring = rings.rings()[r];
    for (const Vec3& p : rings.points(ring))
      u += value(X - p, ring.core.s) * ring_forces[r] / static_cast<double>(ring.count);
  }
  return u;
}

}  // namespace brachy
