#include "core/injectivity/scalar_cells.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "core/injectivity/fold_candidate_points.h"

namespace brachy {
namespace {

constexpr double kSinglePrecision = 1e-5;  // relative to the greatest slope: Buhmann's sum cancels near r = 1
constexpr double kPlaceError = 1e-4;       // mm, of distances in single precision within some metres
constexpr double kCuspReach = 3;  // in half sides of a cell, from it: nearer, a cusp's curvature is too large

// Where |ψ′| is greatest, in support radii; beside the cusp that is at 0.
double steepest_radius(const Kernel& kernel) {
  return std::visit(
      []<class K>(K) {
        double best = 1e-3;
        for (double r = best; r < 1; r += 1e-3)
          if (std::abs(K::derivative(r)) > std::abs(K::derivative(best))) best = r;
        return best;
      },
      kernel);
}

}  // namespace

ScalarCells::ScalarCells(const Kernel& kernel, double support_radius, SimdTarget target,
                         std::size_t max_landmarks)
    : field_{kernel, support_radius, {}, {}},
      loops_(cell_loops(target)),
      gradients_(scalar_gradients(kernel, target)),
      kernel_bounds_(kernel),
      steepest_(support_radius * steepest_radius(kernel)) {
  sizes_.reserve(max_landmarks);
  for (auto* v : {&x_, &y_, &z_, &distances_}) v->resize(max_landmarks);
  chosen_.reserve(max_landmarks);
}

void ScalarCells::set_field(const RbfField& field) noexcept {
  field_ = field;
  sizes_.clear();
  Vec3 min = Vec3::Constant(std::numeric_limits<double>::max()), max = -min;
  for (std::size_t i = 0; i < field.positions.size(); ++i) {
    sizes_.push_back(field.weights[i].norm());
    x_[i] = static_cast<float>(field.positions[i].x());
    y_[i] = static_cast<float>(field.positions[i].y());
    z_[i] = static_cast<float>(field.positions[i].z());
    min = min.cwiseMin(field.positions[i]);
    max = max.cwiseMax(field.positions[i]);
  }
  if (!sizes_.empty()) domain_ = {0.5 * (min + max), 0.5 * (max - min).maxCoeff() + field.support_radius};
}

std::size_t ScalarCells::narrow(const Cell& cell, std::span<const std::uint32_t> from, std::uint32_t* to,
                                CellBounds& bounds) const noexcept {
  const double a = field_.support_radius, inverse = 1 / a, cusp_distance = kCuspReach * cell.half;
  bounds = {};
  const Eigen::Vector3f c = cell.centre.cast<float>();
  loops_.distances({x_.data(), y_.data(), z_.data()}, from.data(), from.size(), c.x(), c.y(), c.z(),
                   static_cast<float>(cell.half), distances_.data());
  std::size_t count = 0;
  double all = 0, slope = 0, third = 0, kinked = 0;
  for (std::size_t k = 0; k < from.size(); ++k) {
    const std::uint32_t i = from[k];
    const double d = static_cast<double>(distances_[k]) - kPlaceError;
    if (d >= a || sizes_[i] == 0) continue;
    to[count++] = i;
    const double r = std::max(d, 0.0) * inverse, size = sizes_[i], slope_here = kernel_bounds_.slope(r);
    all += size;
    if (d + 2 * std::numbers::sqrt3 * cell.half + kPlaceError >= a) kinked += size;
    slope += size * slope_here;
    if (kernel_bounds_.has_cusp() && d < cusp_distance && bounds.cusp < 0) {
      bounds.cusp = static_cast<std::int32_t>(i);
      bounds.cusp_weight = field_.weights[i];
      bounds.cusp_slope = inverse * slope_here;
    } else {
      third += size * kernel_bounds_.third(r);
    }
  }
  bounds.work = count;
  bounds.slope = bounds.squeeze = inverse * slope;
  bounds.curvature = 3 * inverse * inverse * inverse * third;  // Σ_k |∂_k² ∇ψ| ≤ 3 |D³ψ|
  // Across the edge of a support, a function that is linear on both sides is interpolated to within a quarter of the
  // product of jump and spacing along each axis.
  const double kink = kinked * inverse * inverse * kernel_bounds_.kink();
  bounds.rounding = kSinglePrecision * all * inverse * kernel_bounds_.slope(0) +
                    0.25 * std::numbers::sqrt3 * cell.half * kink;
  return count;
}

void ScalarCells::gradients(const Cell& cell, std::span<const std::uint32_t> sources,
                            const CellBounds& bounds, const CellPoints& X, CellGradients& A) const noexcept {
  const double a = field_.support_radius, scale = 1 / (a * a);
  chosen_.clear();
  for (const std::uint32_t i : sources) {
    if (static_cast<std::int32_t>(i) == bounds.cusp) continue;
    const Eigen::Vector3f p = (field_.positions[i] - cell.centre).cast<float>();
    const Eigen::Vector3f w = (scale * field_.weights[i]).cast<float>();
    chosen_.push_back({p.x(), p.y(), p.z(), w.x(), w.y(), w.z()});
  }
  gradients_(X, chosen_.data(), chosen_.size(), static_cast<float>(1 / a), A);
}

bool ScalarCells::fold_candidates(std::uint32_t i, Cell& cell, CellPoints& X) const noexcept {
  if (sizes_[i] == 0) return false;
  cell = {field_.positions[i], 2 * steepest_};
  surround(field_.weights[i] / sizes_[i], steepest_, X);
  return true;
}

}  // namespace brachy
