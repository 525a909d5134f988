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
// At three radii from a ring's axis, and less farther: 2 E(3/4)/π/16 over 8^(−3/2) = 1.09 (an elliptic integral).
constexpr double kRingCubed = 1.1;
constexpr double kSinglePrecisionBounds = 1e-4;  // of bounds that are summed in single precision

// Of forces and of corrections, with what single precision may lack.
double sum_of_bounds(float a, float b) {
  return (1 + kSinglePrecisionBounds) * (static_cast<double>(a) + static_cast<double>(b));
}

}  // namespace

MatrixKernelCells::MatrixKernelCells(const Tissue& tissue, const NearField& near, const SmoothField* smooth,
                                     double needle_radius, SimdTarget target, std::size_t max_rings,
                                     const WorkBudget& budget)
    : near_(near),
      smooth_(smooth),
      clearance_(kClearance * needle_radius),
      loops_(cell_loops(target)),
      bounds_(near.bounds()),
      kelvin_(bounds_.kelvin()),
      budget_(budget),
      near_loops_(near_loops(target)) {
  extent_.rest_min = extent_.rest_max = tissue.rest_vertices.front();
  for (const Vec3& X : tissue.rest_vertices) {
    extent_.rest_min = extent_.rest_min.cwiseMin(X);
    extent_.rest_max = extent_.rest_max.cwiseMax(X);
  }
  chosen_.reserve(max_rings * NeedleRings::kPoints);
  field_.piece_of.reserve(max_rings);
  field_.needles.reserve(max_rings);
  field_.forces.reserve(max_rings);
  field_.piece_forces.reserve(max_rings);
  folds_.strengths.reserve(max_rings);
  folds_.strongest.reserve(budget.strongest_candidates);
  const std::size_t groups = 3 * max_rings / BoundedForces::kCount + 1;  // a piece is two forces
  bounded_.forces.reserve(groups);
  bounded_.corrections.reserve(max_rings / BoundedCorrections::kCount + 1);
}

MatrixKernelCells::Force MatrixKernelCells::force_of(const Vec3& force, double scale) {
  const double size = force.norm();
  return {size > 0 ? Vec3(force / size) : Vec3(Vec3::UnitZ()), scale * size, 0, 1};
}

void MatrixKernelCells::set_field(const NeedleRings& rings, std::span<const Vec3> ring_forces,
                                  std::span<const NearField::Piece> pieces, double margin) noexcept {
  extent_.min = extent_.rest_min.array() - margin;
  extent_.max = extent_.rest_max.array() + margin;
  domain_ = Cell::around(extent_.min, extent_.max);
  field_.rings = &rings;
  field_.ring_forces = ring_forces;
  field_.pieces = pieces;
  folds_.may = budget_.allowance({.sources = ring_forces.size()});
  field_.piece_of.clear();
  for (std::uint32_t p = 0; p < pieces.size(); ++p)
    field_.piece_of.insert(field_.piece_of.end(), pieces[p].count, p);
  field_.forces.clear();
  for (std::size_t r = 0; r < ring_forces.size(); ++r) {
    Force& force = field_.forces.emplace_back(force_of(ring_forces[r], near_.scale()));
    const NeedleRings::Ring& ring = rings.rings()[r];
    if (ring.count == 1) continue;
    force.aside = ring.radius * force.direction.cross(ring.axis).norm();
    force.cubed = kRingCubed;
  }
  field_.piece_forces.clear();
  for (const NearField::Piece& piece : pieces)
    field_.piece_forces.push_back(
        {force_of(piece.whole[0].force, near_.scale()), force_of(piece.whole[1].force, near_.scale())});
  find_needles();
  if (bounds_.is_kelvin()) take_bounded_forces();
  choose_fold_candidates();
}

// How far from a ring its field is steepest, outside the needle.
double MatrixKernelCells::fold_distance(std::size_t ring) const noexcept {
  const NeedleRings::Ring& r = field_.rings->rings()[ring];
  return r.count == 1 ? bounds_.steepest(r.core.s) : 1.2 * clearance_;
}

// By what a piece's forces do together where its field is steepest; of each its strongest ring. Of many rings those
// taken by number would be too far apart.
void MatrixKernelCells::choose_fold_candidates() noexcept {
  folds_.strengths.clear();
  folds_.strongest.clear();
  if (folds_.may.strongest_candidates == 0) return;
  for (const NearField::Piece& piece : field_.pieces) {
    std::uint32_t ring = piece.first;
    for (std::uint32_t r = piece.first; r < piece.first + piece.count; ++r)
      if (field_.forces[r].size > field_.forces[ring].size) ring = r;
    const double distance = fold_distance(ring);
    const double squared =
        distance * distance + field_.rings->rings()[ring].core.s + piece.half_length * piece.half_length;
    folds_.strengths.emplace_back(-piece.size / squared, ring);
  }
  const std::size_t count = std::min(folds_.may.strongest_candidates, folds_.strengths.size());
  std::ranges::partial_sort(folds_.strengths, folds_.strengths.begin() + static_cast<std::ptrdiff_t>(count));
  for (std::size_t k = 0; k < count; ++k) folds_.strongest.push_back(folds_.strengths[k].second);
  std::ranges::sort(folds_.strongest);
}

void MatrixKernelCells::take_bounded_forces() noexcept {
  bounded_.forces.clear();
  bounded_.corrections.clear();
  std::size_t forces = 0, corrections = 0;
  const auto single = [](double x) { return static_cast<float>(x); };
  const auto place = [&](auto& groups, std::size_t& count, const Vec3& at, double s, double size) {
    if (count % BoundedForces::kCount == 0) groups.emplace_back();
    auto& group = groups.back();
    const std::size_t lane = count++ % BoundedForces::kCount;
    const Vec3 x = at - domain_.centre;
    group.x[lane] = single(x.x());
    group.y[lane] = single(x.y());
    group.z[lane] = single(x.z());
    group.s[lane] = single(s);
    group.size[lane] = single(size);
    return lane;
  };
  const auto add = [&](const Force& force, const Vec3& at, const NearField::Piece& piece, bool is_piece,
                       const NeedleRings::Ring& ring) {
    const std::size_t lane = place(bounded_.forces, forces, at, ring.core.s,
                                   !is_piece && ring.count > 1 ? kSixPoints * force.size : force.size);
    BoundedForces& group = bounded_.forces.back();
    group.ring2[lane] = is_piece ? 0 : single(ring.radius * ring.radius);
    group.fx[lane] = single(force.direction.x());
    group.fy[lane] = single(force.direction.y());
    group.fz[lane] = single(force.direction.z());
    group.aside[lane] = single(force.aside);
    group.cubed[lane] = single(force.cubed);
    const Vec3 middle = piece.centre - domain_.centre;
    group.piece.x[lane] = single(middle.x());
    group.piece.y[lane] = single(middle.y());
    group.piece.z[lane] = single(middle.z());
    group.far2[lane] = single(std::min(piece.squared_far(), 1e30));
    group.is_piece[lane] = is_piece ? 1 : 0;
    group.points[lane] = is_piece ? 1 : single(ring.count);
  };
  for (std::size_t p = 0; p < field_.pieces.size(); ++p) {
    const NearField::Piece& piece = field_.pieces[p];
    for (std::uint32_t r = piece.first; r < piece.first + piece.count; ++r) {
      const NeedleRings::Ring& ring = field_.rings->rings()[r];
      if (ring.core.counter_s > 0) {
        const std::size_t lane =
            place(bounded_.corrections, corrections, ring.centre, ring.core.s, field_.forces[r].size);
        bounded_.corrections.back().counter_s[lane] = single(ring.core.counter_s);
      } else {
        add(field_.forces[r], ring.centre, piece, false, ring);
      }
    }
    if (piece.squared_far() < std::numeric_limits<double>::infinity())
      for (std::size_t k = 0; k < 2; ++k)
        add(field_.piece_forces[p][k], piece.whole[k].at, piece, true, field_.rings->rings()[piece.first]);
  }
  bounded_.correction_work = 2 * corrections;
}

BoundedCell MatrixKernelCells::bounded(const Cell& cell) const noexcept {
  const Eigen::Vector3f x = (cell.centre - domain_.centre).cast<float>();
  const double least = clearance_ - kStraight, far = near_.far_distance();
  return {x.x(),
          x.y(),
          x.z(),
          static_cast<float>(cell.half),
          static_cast<float>(least * least),
          static_cast<float>(far * far)};
}

void MatrixKernelCells::add_kelvin_bounds(const Cell& cell, CellBounds& bounds) const noexcept {
  const BoundedCell asked = bounded(cell);
  const BoundSums forces =
      near_loops_.kelvin_bounds(bounded_.forces.data(), bounded_.forces.size(), kelvin_, asked);
  const BoundSums corrections =
      near_loops_.correction_bounds(bounded_.corrections.data(), bounded_.corrections.size(), kelvin_, asked);
  bounds.slope = sum_of_bounds(forces.slope, corrections.slope);
  bounds.squeeze = sum_of_bounds(forces.squeeze, corrections.squeeze);
  bounds.shrink = sum_of_bounds(forces.shrink, corrections.shrink);
}

void MatrixKernelCells::bound_curvature(const Cell& cell, CellBounds& bounds) const noexcept {
  if (!bounds_.is_kelvin()) return;
  const BoundedCell asked = bounded(cell);
  const CurvatureSums forces =
      near_loops_.kelvin_curvatures(bounded_.forces.data(), bounded_.forces.size(), kelvin_, asked);
  bounds.curvature = sum_of_bounds(
      forces.curvature, near_loops_.correction_curvatures(bounded_.corrections.data(),
                                                          bounded_.corrections.size(), kelvin_, asked));
  bounds.work = static_cast<std::size_t>(forces.work) + bounded_.correction_work;
}

// Rings that follow one another on one shaft enclose a piece of needle. Those on one line make one piece.
void MatrixKernelCells::find_needles() noexcept {
  field_.needles.clear();
  const auto rings = field_.rings->rings();
  std::size_t first = 0;  // ring of the last piece
  bool continues = false;
  for (std::size_t r = 0; r + 1 < rings.size(); ++r) {
    const std::uint32_t next = rings[r + 1].landmark[0];
    const bool is_one_shaft = rings[r].radius > 0 && rings[r + 1].radius > 0 &&
                              (next == rings[r].landmark[0] || next == rings[r].landmark[1]);
    if (!is_one_shaft) {
      continues = false;
      continue;
    }
    if (continues && is_straight(first, r + 1)) {
      field_.needles.back() = {rings[first].centre, rings[r + 1].centre};
      continue;
    }
    field_.needles.emplace_back(rings[r].centre, rings[r + 1].centre);
    first = r;
    continues = true;
  }
}

bool MatrixKernelCells::is_straight(std::size_t first, std::size_t last) const noexcept {
  const auto rings = field_.rings->rings();
  const Segment line(rings[first].centre, rings[last].centre);
  for (std::size_t r = first + 1; r < last; ++r)
    if (line.squared_distance(rings[r].centre) > kStraight * kStraight) return false;
  return true;
}

double MatrixKernelCells::distance_to_needles(const Vec3& X) const noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (const Segment& needle : field_.needles) least = std::min(least, needle.squared_distance(X));
  return std::sqrt(least);
}

bool MatrixKernelCells::is_in_needle(const Cell& cell) const noexcept {
  const double reach = clearance_ - std::numbers::sqrt3 * cell.half;
  return reach > 0 && distance_to_needles(cell.centre) < reach;
}

// Of the compact kernel, as near_loops.cpp has those of Kelvin's solution: what is asked lies outside the needle, what
// is interpolated may not.
void MatrixKernelCells::add_ring_bounds(std::uint32_t r, double distance, CellBounds& bounds) const noexcept {
  const NeedleRings::Ring& ring = field_.rings->rings()[r];
  const double force = field_.forces[r].size;
  const bool is_ring = ring.count > 1;
  const double R2 = ring.radius * ring.radius, asked = is_ring ? std::max(distance, clearance_) : distance;
  const NearBounds::At at = bounds_.at(std::sqrt(asked * asked - R2));
  const double shared = is_ring ? kSixPoints * force : force;
  bounds.slope += shared * at.slope;
  bounds.squeeze += shared * at.squeeze;
  bounds.shrink += shared * at.shrink;
  const double inner = distance * distance - R2;
  if (!is_ring)
    bounds.curvature += force * at.curvature;
  else if (inner < 3 * R2)
    bounds.curvature = std::numeric_limits<double>::infinity();  // too near to be interpolated
  else  // the mean of 1/d⁴ is (q + R²)/(q − R²)³ at most
    bounds.curvature += shared * (1 + 2 * R2 / inner) * bounds_.at(std::sqrt(inner)).curvature;
  bounds.work += is_ring && !near_.is_far(distance) ? ring.count : 1;
}

void MatrixKernelCells::add_piece_bounds(std::uint32_t p, const Cell& cell,
                                         CellBounds& bounds) const noexcept {
  const NearField::Piece& piece = field_.pieces[p];
  for (std::size_t k = 0; k < 2; ++k) {
    const double force = field_.piece_forces[p][k].size;
    const NearBounds::At at = bounds_.at(std::sqrt(cell.squared_distance(piece.whole[k].at)));
    bounds.slope += force * at.slope;
    bounds.squeeze += force * at.squeeze;
    bounds.shrink += force * at.shrink;
    bounds.curvature += force * at.curvature;
  }
  bounds.work += 2;
}

std::size_t MatrixKernelCells::narrow(const Cell& cell, std::span<const std::uint32_t> from,
                                      std::uint32_t* to, CellBounds& bounds) const noexcept {
  bounds = {};
  bounds.shrink = 0;
  if (((cell.centre - extent_.min).array() < -cell.half).any() ||
      ((cell.centre - extent_.max).array() > cell.half).any())
    return 0;
  if (is_in_needle(cell)) return 0;
  if (bounds_.is_kelvin()) {
    std::ranges::copy(from, to);  // it reaches everywhere
    add_kelvin_bounds(cell, bounds);
    bounds.rounding += kSinglePrecision * bounds.slope;
    if (smooth_) smooth_->add_bounds(cell, bounds);
    return from.size();
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < from.size();) {
    const std::uint32_t p = field_.piece_of[from[i]];
    if (const double d2 = cell.squared_distance(field_.pieces[p].centre); field_.pieces[p].is_far(d2)) {
      add_piece_bounds(p, cell, bounds);
      for (; i < from.size() && field_.piece_of[from[i]] == p; ++i) to[count++] = from[i];
      continue;
    }
    const std::uint32_t r = from[i++];
    const NeedleRings::Ring& ring = field_.rings->rings()[r];
    const double distance = std::sqrt(cell.squared_distance(ring.centre));
    if (field_.ring_forces[r].isZero(0) || distance - ring.radius >= near_.reach()) continue;
    to[count++] = r;
    add_ring_bounds(r, distance, bounds);
  }
  bounds.rounding += kSinglePrecision * bounds.slope;
  if (smooth_ && count > 0) smooth_->add_bounds(cell, bounds);
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
  const auto squared_distance = [&](const Vec3& p) { return cell.squared_distance(p); };
  std::uint32_t done = 0;  // pieces: a source of each is enough
  for (const std::uint32_t r : sources) {
    const std::uint32_t p = field_.piece_of[r];
    if (p < done) continue;
    near_.add_sources(*field_.rings, field_.ring_forces, field_.pieces[p], squared_distance, cell.centre,
                      false, chosen_);
    done = p + 1;
  }
  near_.add_gradients(X, chosen_, A);
}

bool MatrixKernelCells::fold_candidates(std::uint32_t i, Cell& cell, CellPoints& X) const noexcept {
  const bool is_last = i + 1 == field_.ring_forces.size();
  const double force = field_.ring_forces[i].norm();
  const bool is_asked = folds_.strongest.empty() ? i % folds_.may.candidate_stride == 0 || is_last
                                                 : std::ranges::binary_search(folds_.strongest, i);
  if (force == 0 || !is_asked) return false;
  const NeedleRings::Ring& ring = field_.rings->rings()[i];
  const double distance = fold_distance(i);
  cell = {ring.centre, 2 * distance};
  surround(field_.ring_forces[i] / force, distance, X);
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

// With many sources the gradient is the one that blocks use.
Mat3 MatrixKernelCells::gradient(const Vec3& X) const noexcept {
  Mat3 A = folds_.may.may_sum_single_rings
               ? near_.gradient_at(X, *field_.rings, field_.ring_forces)
               : near_.gradient_at(X, *field_.rings, field_.ring_forces, field_.pieces);
  if (smooth_) A += smooth_->gradient_at(X);
  return A;
}

}  // namespace brachy
