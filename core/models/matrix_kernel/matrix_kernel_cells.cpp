#include "core/models/matrix_kernel/matrix_kernel_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/injectivity/fold_candidate_points.h"

namespace brachy {
namespace {

constexpr double kSinglePrecision = 1e-5;  // of the slopes summed
constexpr double kSixPoints = 1.05;
constexpr std::size_t kFoldCandidates = 12;  // rings of a needle that are searched for folds

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-12), 0.0, 1.0);
  return (p - a - t * ab).norm();
}

}  // namespace

MatrixKernelCells::MatrixKernelCells(const Tissue& tissue, const NearField& near, const SmoothField* smooth,
                                     double needle_radius, SimdTarget target, std::size_t max_rings)
    : near_(near),
      smooth_(smooth),
      clearance_(kClearance * needle_radius),
      loops_(cell_loops(target)),
      bounds_(near.bounds()),
      min_(tissue.rest_vertices.front()),
      max_(min_) {
  for (const Vec3& X : tissue.rest_vertices) {
    min_ = min_.cwiseMin(X);
    max_ = max_.cwiseMax(X);
  }
  domain_ = Cell::around(min_, max_);
  chosen_.reserve(max_rings * NeedleRings::kPoints);
  piece_of_.reserve(max_rings);
}

void MatrixKernelCells::set_field(const NeedleRings& rings, std::span<const Vec3> ring_forces,
                                  std::span<const NearField::Piece> pieces) noexcept {
  rings_ = &rings;
  ring_forces_ = ring_forces;
  pieces_ = pieces;
  piece_of_.clear();
  for (std::uint32_t p = 0; p < pieces.size(); ++p) piece_of_.insert(piece_of_.end(), pieces[p].count, p);
  fold_candidate_every_ = 1 + ring_forces.size() / kFoldCandidates;
}

// Rings that follow one another on one shaft enclose a piece of needle.
bool MatrixKernelCells::is_in_needle(const Cell& cell) const noexcept {
  const auto rings = rings_->rings();
  const double reach = clearance_ - std::numbers::sqrt3 * cell.half;
  if (reach <= 0) return false;
  for (std::size_t r = 0; r + 1 < rings.size(); ++r) {
    const bool is_one_shaft =
        rings[r].radius > 0 && rings[r + 1].radius > 0 && rings[r + 1].landmark[0] <= rings[r].landmark[1];
    if (is_one_shaft && distance_to_segment(cell.centre, rings[r].centre, rings[r + 1].centre) < reach)
      return true;
  }
  return false;
}

// A ring of radius R is on average 1/√((q + R²)² − 4 R² ρ²) ≤ 1/(q − R²) in 1/d², q the distance² of its centre and ρ
// that of its axis; its six points do the same up to 2 (R/ρ)⁶. What is asked lies outside the needle, what is
// interpolated may not.
void MatrixKernelCells::add_ring_bounds(std::uint32_t r, double distance, CellBounds& bounds) const noexcept {
  const NeedleRings::Ring& ring = rings_->rings()[r];
  const double force = near_.scale() * ring_forces_[r].norm();
  const bool is_ring = ring.count > 1;
  const double R2 = ring.radius * ring.radius, asked = is_ring ? std::max(distance, clearance_) : distance;
  const NearBounds::At at = bounds_.at(std::sqrt(asked * asked - R2), ring.core.s);
  const double shared = is_ring ? kSixPoints * force : force;
  bounds.slope += shared * at.slope;
  bounds.squeeze += shared * at.squeeze;
  const double inner = distance * distance - R2;
  if (!is_ring)
    bounds.curvature += force * at.curvature;
  else if (inner < 3 * R2)
    bounds.curvature = std::numeric_limits<double>::infinity();  // too near to be interpolated
  else  // the mean of 1/d⁴ is (q + R²)/(q − R²)³ at most
    bounds.curvature += shared * (1 + 2 * R2 / inner) * bounds_.at(std::sqrt(inner), ring.core.s).curvature;
  bounds.work += is_ring && !near_.is_far(distance) ? ring.count : 1;
}

void MatrixKernelCells::add_piece_bounds(const NearField::Piece& piece, double distance,
                                         CellBounds& bounds) const noexcept {
  // Its two points lie within its half length.
  const double force = near_.scale() * (piece.force[0].norm() + piece.force[1].norm());
  const NearBounds::At at = bounds_.at(distance - piece.half_length, rings_->rings()[piece.first].core.s);
  bounds.slope += force * at.slope;
  bounds.squeeze += force * at.squeeze;
  bounds.curvature += force * at.curvature;
  bounds.work += 2;
}

std::size_t MatrixKernelCells::narrow(const Cell& cell, std::span<const std::uint32_t> from,
                                      std::uint32_t* to, CellBounds& bounds) const noexcept {
  bounds = {};
  if (((cell.centre - min_).array() < -cell.half).any() || ((cell.centre - max_).array() > cell.half).any())
    return 0;
  if (is_in_needle(cell)) return 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < from.size();) {
    const std::uint32_t p = piece_of_[from[i]];
    if (const double d2 = cell.squared_distance(pieces_[p].centre); pieces_[p].is_far(d2)) {
      add_piece_bounds(pieces_[p], std::sqrt(d2), bounds);
      for (; i < from.size() && piece_of_[from[i]] == p; ++i) to[count++] = from[i];
      continue;
    }
    const std::uint32_t r = from[i++];
    const NeedleRings::Ring& ring = rings_->rings()[r];
    const double distance = std::sqrt(cell.squared_distance(ring.centre));
    if (ring_forces_[r].isZero(0) || distance - ring.radius >= near_.reach()) continue;
    to[count++] = r;
    add_ring_bounds(r, distance, bounds);
  }
  bounds.rounding += kSinglePrecision * bounds.slope;
  if (smooth_ && count > 0) {
    const Mat3 here = smooth_->gradient_at(cell.centre);
    const double varies = smooth_->gradient_varies(cell.centre, cell.half);
    bounds.slope += here.rowwise().norm().sum() + varies;
    bounds.squeeze += 0.5 * (here + here.transpose()).norm() + varies;
    bounds.rounding += varies;
  }
  return count;
}

void MatrixKernelCells::gradients(const Cell& cell, std::span<const std::uint32_t> sources,
                                  const CellBounds& /*bounds*/, const CellPoints& X,
                                  CellGradients& A) const noexcept {
  const Mat3 here = smooth_ ? smooth_->gradient_at(cell.centre) : Mat3::Zero();
  for (std::size_t k = 0; k < 9; ++k)
    std::fill_n(A.a[k], CellPoints::kCount,
                static_cast<float>(here(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3))));
  chosen_.clear();
  for (std::size_t i = 0; i < sources.size();) {
    const std::uint32_t r = sources[i], p = piece_of_[r];
    if (pieces_[p].is_far(cell.squared_distance(pieces_[p].centre))) {
      near_.add_piece(*rings_, pieces_[p], cell.centre, chosen_);
      while (i < sources.size() && piece_of_[sources[i]] == p) ++i;
      continue;
    }
    ++i;
    const NeedleRings::Ring& ring = rings_->rings()[r];
    const bool is_one = ring.count == 1 || near_.is_far(std::sqrt(cell.squared_distance(ring.centre)));
    near_.add_sources(*rings_, ring, is_one, ring_forces_[r], cell.centre, chosen_);
  }
  near_.add_gradients(X, chosen_, A);
}

bool MatrixKernelCells::fold_candidates(std::uint32_t i, Cell& cell, CellPoints& X) const noexcept {
  const bool is_last = i + 1 == ring_forces_.size();
  const double force = ring_forces_[i].norm();
  if (force == 0 || (i % fold_candidate_every_ != 0 && !is_last)) return false;
  const NeedleRings::Ring& ring = rings_->rings()[i];
  const double distance = ring.count == 1 ? bounds_.steepest(ring.core.s) : 1.2 * clearance_;
  cell = {ring.centre, 2 * distance};
  surround(ring_forces_[i] / force, distance, X);
  // Points within the needle are not checked: they are replaced by the first point outside it.
  std::size_t outside = CellPoints::kCount;
  const auto point = [&](std::size_t k) -> Vec3 { return ring.centre + X.at(k); };
  for (std::size_t k = 0; k < CellPoints::kCount && outside == CellPoints::kCount; ++k)
    if (covers(point(k))) outside = k;
  if (outside == CellPoints::kCount) return false;
  for (std::size_t k = 0; k < CellPoints::kCount; ++k)
    if (!covers(point(k))) X.set(k, X.at(outside));
  return true;
}

Mat3 MatrixKernelCells::gradient(const Vec3& X) const noexcept {
  Mat3 A = near_.gradient_at(X, *rings_, ring_forces_);
  if (smooth_) A += smooth_->gradient_at(X);
  return A;
}

}  // namespace brachy
