#include "core/models/matrix_kernel/near_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/elasticity/kelvin.h"
#include "core/elasticity/landmark_stiffness.h"

namespace brachy {

namespace {

constexpr double kCoaxial = 1e-6;  // mm, and radians: rings on one axis

// s of a point that stands for a ring. Its points have the variance R²/2 in each of two directions, R²/3 averaged over
// all; Kelvin's solution with that is the one of s + 2 R²/3, as for pairs (NearField::Piece).
double spread_of(const NeedleRings::Ring& ring) {
  return ring.core.s + 2 * ring.radius * ring.radius / 3;
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
      loop_scale_(scale),
      far_distance_(kFarRadii * needle_radius),
      far_pair2_(Piece::kFarPairs * Piece::kFarPairs * needle_radius * needle_radius),
      loops_(near_loops(target)),
      blocks_(tissue) {}

NearField::NearField(const Tissue& tissue, const ElasticKernel& kernel, double weight, SimdTarget target)
    : NearField(tissue, weight / kernel.body().shear_modulus, kernel.body().needle_radius, target) {
  elastic_ = &kernel;
  loop_scale_ = scale_ / (4 * std::numbers::pi);
  kelvin_b_ = static_cast<float>(kelvin_share());
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
  const Vec3 apart = a.centre - b.centre;
  if (a.count > 1 && b.count > 1 && apart.cross(a.axis).squaredNorm() < kCoaxial * kCoaxial &&
      b.axis.cross(a.axis).squaredNorm() < kCoaxial * kCoaxial)
    return between_coaxial(rings, a, b, s);
  Mat3 sum = Mat3::Zero();
  for (const Vec3& p : rings.points(a))
    for (const Vec3& q : rings.points(b)) sum += value(p - q, s);
  return sum / static_cast<double>(a.count * b.count);
}

// Turned by a sixth both rings are what they were: so their mean is even about the axis, and one point of a with all
// of b has its two values.
Mat3 NearField::between_coaxial(const NeedleRings& rings, const NeedleRings::Ring& a,
                                const NeedleRings::Ring& b, double s) const noexcept {
  const Vec3& p = rings.points(a).front();
  double along = 0, trace = 0;
  for (const Vec3& q : rings.points(b)) {
    const Mat3 v = value(p - q, s);
    along += a.axis.dot(v * a.axis) / b.count;
    trace += v.trace() / b.count;
  }
  const double across = 0.5 * (trace - along);
  return across * Mat3::Identity() + (along - across) * a.axis * a.axis.transpose();
}

void NearField::add_ring(const NeedleRings& rings, const NeedleRings::Ring& ring, bool as_one,
                         const Vec3& force, const Vec3& centre,
                         std::vector<NearSource>& sources) const noexcept {
  if (ring.core.counter_s > 0) add_source({ring.centre, -force, ring.core.counter_s}, centre, sources);
  if (as_one) return add_source({ring.centre, force, spread_of(ring)}, centre, sources);
  const Eigen::Vector3f g = of_loops(force / static_cast<double>(ring.count));
  const auto square = static_cast<float>(ring.core.s);
  for (const Vec3& at : rings.points(ring)) {
    const Eigen::Vector3f p = (at - centre).cast<float>();
    sources.push_back({p.x(), p.y(), p.z(), square, g.x(), g.y(), g.z(), 0});
  }
}

void NearField::add_source(const Point& point, const Vec3& centre,
                           std::vector<NearSource>& sources) const noexcept {
  const Eigen::Vector3f p = (point.at - centre).cast<float>(), g = of_loops(point.force);
  sources.push_back({p.x(), p.y(), p.z(), static_cast<float>(point.s), g.x(), g.y(), g.z(), 0});
}

// Equal forces at t along the piece have the second moment of two at ± the root mean square of t: what is left is of
// fourth order in length over distance, of third where the forces grow along it.
void NearField::take_pieces(const NeedleRings& rings, std::span<const Vec3> ring_forces,
                            std::vector<Piece>& pieces) noexcept {
  pieces.clear();
  const auto all = rings.rings();
  for (std::uint32_t begin = 0, end = 0; begin < ring_forces.size(); begin = end) {
    const NeedleRings::Ring& ring = all[begin];
    const auto [first, count, centre, half_length, arm] = rings.piece_at(begin, ring_forces.size());
    end = first + count;
    Piece piece;
    piece.first = first;
    piece.count = count;
    piece.centre = centre;
    piece.half_length = half_length;
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
    for (std::uint32_t r = begin; r < end; ++r) {
      const double t = (all[r].centre - centre).dot(ring.axis);
      force += ring_forces[r];
      piece.size += ring_forces[r].norm();
      moment += t * ring_forces[r];
    }
    for (std::size_t k = 0; k < 2 && arm > 0; ++k) {
      const double side = k == 0 ? -1 : 1;
      piece.whole[k] = {centre + side * arm * ring.axis, 0.5 * (force + side / arm * moment),
                        spread_of(ring)};
    }
    take_pairs(all, ring_forces, piece);
    pieces.push_back(piece);
  }
}

// The force's point divides the way between two rings as their shares along it do.
void NearField::take_pairs(std::span<const NeedleRings::Ring> rings, std::span<const Vec3> forces,
                           Piece& piece) noexcept {
  for (std::uint32_t k = 0; k < piece.count / 2; ++k) {
    const std::uint32_t r = piece.first + 2 * k;
    const NeedleRings::Ring &a = rings[r], &b = rings[r + 1];
    const Vec3 way = b.centre - a.centre, force = forces[r] + forces[r + 1];
    const double aside = 0.25 * (a.radius * a.radius + b.radius * b.radius), along = 0.25 * way.squaredNorm();
    if (std::abs(along - aside) > Piece::kEven * aside) return;
    const double size2 = force.squaredNorm();
    const double t = size2 > 0 ? std::clamp(forces[r + 1].dot(force) / size2, 0.0, 1.0) : 0.5;
    piece.pairs[k] = {a.centre + t * way, force, 0.5 * (spread_of(a) + spread_of(b)) + 2 * along / 3};
    piece.pair_count = k + 1;
  }
}

void NearField::add_to_block(std::uint32_t b, const NeedleRings& rings, std::span<const Vec3> ring_forces,
                             std::span<const Piece> pieces, std::vector<NearSource>& sources,
                             BlockDisplacement<float>& u) const noexcept {
  add_to_points(blocks_.points[b], blocks_.centres[b], tissue_.blocks[b], rings, ring_forces, pieces, sources,
                u);
}

void NearField::add_to_points(const BlockPoints<float>& X, const Vec3& centre, const Block& box,
                              const NeedleRings& rings, std::span<const Vec3> ring_forces,
                              std::span<const Piece> pieces, std::vector<NearSource>& sources,
                              BlockDisplacement<float>& u, std::size_t count) const noexcept {
  sources.clear();
  const auto squared_distance = [&](const Vec3& p) { return box.squared_distance(p); };
  for (const Piece& piece : pieces)
    if (piece.reaches(squared_distance(piece.centre)))
      add_sources(rings, ring_forces, piece, squared_distance, centre, false, sources);
  if (elastic_)
    (count <= NearLoops::kFew ? loops_.kelvin_few : loops_.kelvin)(X, sources.data(), sources.size(),
                                                                   kelvin_b_, u);
  else
    loops_.compact(X, sources.data(), sources.size(), shape_, u);
}

double NearField::compliance_times_core() const {
  const double poisson = elastic_->body().poisson;
  return scale_ / elastic_landmark_stiffness(1, poisson, 1);
}

double NearField::kelvin_share() const {
  return 1 / (4 * (1 - elastic_->body().poisson));
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

Mat3 NearField::gradient(const Vec3& x, double s, const Vec3& force) const noexcept {
  return elastic_ ? Mat3(scale_ * kelvin_gradient(x, s, elastic_->body().poisson, force))
                  : compact_->gradient(x, force);
}

Mat3 NearField::gradient_at(const Vec3& X, const NeedleRings& rings,
                            std::span<const Vec3> ring_forces) const noexcept {
  Mat3 A = Mat3::Zero();
  for (std::size_t r = 0; r < ring_forces.size(); ++r) {
    const NeedleRings::Ring& ring = rings.rings()[r];
    const Vec3 force = ring_forces[r] / static_cast<double>(ring.count);
    for (const Vec3& p : rings.points(ring)) A += gradient(X - p, ring.core.s, force);
    if (ring.core.counter_s > 0) A -= gradient(X - ring.centre, ring.core.counter_s, force);
  }
  return A;
}

Mat3 NearField::gradient_at(const Vec3& X, const NeedleRings& rings, std::span<const Vec3> ring_forces,
                            std::span<const Piece> pieces) const noexcept {
  Mat3 A = Mat3::Zero();
  const auto squared_distance = [&](const Vec3& p) { return (X - p).squaredNorm(); };
  for (const Piece& piece : pieces) {
    if (!piece.reaches(squared_distance(piece.centre))) continue;
    visit_sources(
        rings, ring_forces, piece, squared_distance,
        [&](const Point& point) { A += gradient(X - point.at, point.s, point.force); },
        [&](const NeedleRings::Ring& ring, const Vec3& force, bool is_far) {
          if (ring.core.counter_s > 0) A -= gradient(X - ring.centre, ring.core.counter_s, force);
          if (is_far) {
            A += gradient(X - ring.centre, spread_of(ring), force);
            return;
          }
          const Vec3 share = force / static_cast<double>(ring.count);
          for (const Vec3& p : rings.points(ring)) A += gradient(X - p, ring.core.s, share);
        });
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
    if (ring.core.counter_s > 0) u -= value(X - ring.centre, ring.core.counter_s) * ring_forces[r];
  }
  return u;
}

}  // namespace brachy
