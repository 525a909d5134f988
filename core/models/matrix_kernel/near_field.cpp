#include "core/models/matrix_kernel/near_field.h"

#include <cmath>
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
  const double s = a.core.with(b.core);
  if ((a.count == 1 && b.count == 1) || is_far) return value(a.centre - b.centre, s);
  Mat3 sum = Mat3::Zero();
  for (const Vec3& p : rings.points(a))
    for (const Vec3& q : rings.points(b)) sum += value(p - q, s);
  return sum / static_cast<double>(a.count * b.count);
}

void NearField::add_sources(const NeedleRings& rings, const NeedleRings::Ring& ring, bool as_one,
                            const Vec3& force, const Vec3& centre,
                            std::vector<NearSource>& sources) const noexcept {
  if (as_one) return add_source(ring.centre, ring.core.s, force, centre, sources);
  for (const Vec3& p : rings.points(ring))
    add_source(p, ring.core.s, force / static_cast<double>(ring.count), centre, sources);
}

void NearField::add_source(const Vec3& at, double s, const Vec3& force, const Vec3& centre,
                           std::vector<NearSource>& sources) const noexcept {
  const double scale = elastic_ ? scale_ / (4 * std::numbers::pi) : scale_;
  const Eigen::Vector3f p = (at - centre).cast<float>(), g = (scale * force).cast<float>();
  sources.push_back({p.x(), p.y(), p.z(), static_cast<float>(s), g.x(), g.y(), g.z(), 0});
}

// Equal forces at t along the piece have the second moment of two at ± the root mean square of t: what is left is of
// fourth order in length over distance, of third where the forces grow along it.
void NearField::take_pieces(const NeedleRings& rings, std::span<const Vec3> ring_forces,
                            std::vector<Piece>& pieces) noexcept {
  pieces.clear();
  const auto all = rings.rings();
  for (std::uint32_t begin = 0, end = 0; begin < ring_forces.size(); begin = end) {
    const NeedleRings::Ring& ring = all[begin];
    for (end = begin + 1; end < ring_forces.size() && ring.count > 1 && all[end].landmark == ring.landmark;)
      ++end;
    Piece piece;
    piece.first = begin;
    piece.count = end - begin;
    piece.centre = 0.5 * (ring.centre + all[end - 1].centre);
    piece.half_length = 0.5 * (all[end - 1].centre - ring.centre).norm();
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
    double square = 0;
    for (std::uint32_t r = begin; r < end; ++r) {
      const double t = (all[r].centre - piece.centre).dot(ring.axis);
      force += ring_forces[r];
      moment += t * ring_forces[r];
      square += t * t / piece.count;
    }
    const double arm = std::sqrt(square);
    for (std::size_t k = 0; k < 2 && arm > 0; ++k) {
      const double side = k == 0 ? -1 : 1;
      piece.at[k] = piece.centre + side * arm * ring.axis;
      piece.force[k] = 0.5 * (force + side / arm * moment);
    }
    pieces.push_back(piece);
  }
}

void NearField::add_piece(const NeedleRings& rings, const Piece& piece, const Vec3& centre,
                          std::vector<NearSource>& sources) const noexcept {
  for (std::size_t k = 0; k < 2; ++k)
    add_source(piece.at[k], rings.rings()[piece.first].core.s, piece.force[k], centre, sources);
}

void NearField::add_to_block(std::uint32_t b, const NeedleRings& rings, std::span<const Vec3> ring_forces,
                             std::span<const Piece> pieces, std::vector<NearSource>& sources,
                             BlockDisplacement<float>& u) const noexcept {
  sources.clear();
  const Block& block = tissue_.blocks[b];
  const Vec3& centre = blocks_.centres[b];
  for (const Piece& piece : pieces) {
    if (piece.is_far(block.squared_distance(piece.centre))) {
      add_piece(rings, piece, centre, sources);
      continue;
    }
    for (std::uint32_t r = piece.first; r < piece.first + piece.count; ++r) {
      const NeedleRings::Ring& ring = rings.rings()[r];
      const bool as_one =
          ring.count == 1 || block.squared_distance(ring.centre) > far_distance_ * far_distance_;
      add_sources(rings, ring, as_one, ring_forces[r], centre, sources);
    }
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
