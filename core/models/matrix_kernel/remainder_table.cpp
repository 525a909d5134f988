#include "core/models/matrix_kernel/remainder_table.h"

#include <algorithm>
#include <cmath>

#include "core/elasticity/kelvin.h"

namespace brachy {
namespace {

// Lagrange's weights of four nodes at 0, 1, 2, 3 for t in [0, 3].
std::array<float, 4> cubic_weights(double t) {
  const double a = t, b = t - 1, c = t - 2, d = t - 3;
  return {static_cast<float>(-b * c * d / 6), static_cast<float>(a * c * d / 2),
          static_cast<float>(-a * b * d / 2), static_cast<float>(a * b * c / 6)};
}

std::array<float, 4> cubic_slopes(double t, double spacing) {
  const double a = t, b = t - 1, c = t - 2, d = t - 3, h = 6 * spacing;
  return {static_cast<float>(-(c * d + b * d + b * c) / h),
          static_cast<float>((c * d + a * d + a * c) / (h / 3)),
          static_cast<float>(-(b * d + a * d + a * b) / (h / 3)),
          static_cast<float>((b * c + a * c + a * b) / h)};
}

struct Makeup {
  std::size_t main = 0;   // material of most points
  bool is_mixed = false;  // some inner point is of another
};

Makeup makeup_of(const Tissue& tissue, const ElasticBody& body) {
  std::vector<double> total(body.regions.size() + 1), shares(total.size());
  for (std::size_t i = tissue.surface_count; i < tissue.size(); ++i) {
    body.material_shares(tissue.rest_vertices[i], shares);
    for (std::size_t m = 0; m < shares.size(); ++m) total[m] += shares[m];
  }
  const auto most = std::max_element(total.begin(), total.end());
  const double sum = static_cast<double>(tissue.size() - tissue.surface_count);
  // A point or two beside the region's surface do not make a mixture.
  return {static_cast<std::size_t>(most - total.begin()), *most < 0.99 * sum};
}

}  // namespace

RemainderTable::RemainderTable(const Tissue& tissue, const ElasticKernel& kernel, double spacing,
                               SimdTarget target)
    : loops_(near_loops(target)) {
  place_planes(tissue, kernel.remainder(), spacing);
  const Makeup makeup = makeup_of(tissue, kernel.body());
  near_weight_ = 1 / kernel.body().materials()[makeup.main];
  fill(kernel, makeup.is_mixed);
}

void RemainderTable::place_planes(const Tissue& tissue, const Remainder* remainder, double spacing) {
  Vec3 min = tissue.rest_vertices.front(), max = min;
  for (const Vec3& X : tissue.rest_vertices) {
    min = min.cwiseMin(X);
    max = max.cwiseMax(X);
  }
  if (remainder) planes_ = remainder->planes();
  is_linear_ = !planes_[0].empty();
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    std::vector<double>& p = planes_[k];
    if (is_linear_) {  // those that the tissue lies between, and four at least
      auto first = std::prev(std::upper_bound(p.begin() + 1, p.end() - 4, min[axis]));
      auto last = std::max(std::lower_bound(p.begin(), p.end() - 1, max[axis]) + 1, first + 4);
      p = std::vector<double>(first, last);
    } else {
      const double extent = std::max(max[axis] - min[axis], 1e-3);
      const int cells = std::max(3, static_cast<int>(std::ceil(extent / spacing)));
      for (int i = 0; i <= cells; ++i) p.push_back(min[axis] + extent * i / cells);
    }
    count_[k] = static_cast<std::uint32_t>(p.size());
  }
}

void RemainderTable::fill(const ElasticKernel& kernel, bool is_mixed) {
  const ElasticBody& body = kernel.body();
  const auto n = static_cast<Eigen::Index>(3 * nodes());
  table_.resize(static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
  if (!kernel.remainder()) return;
  std::vector<Vec3> at;
  for (std::uint32_t node = 0; node < nodes(); ++node) at.push_back(position(node));
  const auto copy = [n](const Eigen::MatrixXd& D, double factor, std::vector<float>& to) {
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index i = 0; i < n; ++i)
        to[static_cast<std::size_t>(j * n + i)] = static_cast<float>(0.5 * factor * (D(i, j) + D(j, i)));
  };
  if (is_mixed) {
    const Vec3 cell =
        (at.back() - at.front()).cwiseQuotient(Vec3(count_[0] - 1, count_[1] - 1, count_[2] - 1));
    const double s = 0.5 * cell.squaredNorm() / 3;
    const PointGroups groups = PointGroups::single(at, s);
    Eigen::MatrixXd D = kernel.between(groups, groups);
    for (std::size_t i = 0; i < at.size(); ++i)
      for (std::size_t j = 0; j < at.size(); ++j)
        D.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) -=
            near_weight_ / body.shear_modulus * kelvin(at[i] - at[j], 2 * s, body.poisson);
    return copy(D, 1, table_);
  }
  const PointGroups groups = PointGroups::single(at, 0);
  Remainder::Parts parts = kernel.remainder()->between(groups, groups);
  if (!body.regions.empty()) {
    held_.resize(table_.size());
    copy(parts.held, 1 / body.shear_modulus, held_);
  }
  parts.held *= -near_weight_;
  if (parts.motion.size() > 0) parts.held += parts.motion;
  copy(parts.held, 1 / body.shear_modulus, table_);
}

bool RemainderTable::covers(const Vec3& X) const noexcept {
  constexpr double kSlack = 0.5;  // mm: a contact lies on the surface, an entry a hair outside
  for (std::size_t k = 0; k < 3; ++k) {
    const double x = X[static_cast<Eigen::Index>(k)];
    if (!(x >= planes_[k].front() - kSlack && x <= planes_[k].back() + kSlack)) return false;
  }
  return true;
}

Vec3 RemainderTable::position(std::uint32_t node) const noexcept {
  const std::uint32_t x = node % count_[0], y = node / count_[0] % count_[1],
                      z = node / count_[0] / count_[1];
  return {planes_[0][x], planes_[1][y], planes_[2][z]};
}

GridPoint RemainderTable::locate(const Vec3& X) const noexcept {
  GridPoint slopes;
  return locate(X, slopes);
}

GridPoint RemainderTable::locate(const Vec3& X, GridPoint& slopes) const noexcept {
  GridPoint p;
  slopes = {};
  const std::array<std::array<float, 4>*, 3> weights = {&p.wx, &p.wy, &p.wz},
                                             derivatives = {&slopes.wx, &slopes.wy, &slopes.wz};
  std::array<std::uint32_t, 3> first{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::vector<double>& planes = planes_[k];
    const double x = std::clamp(X[static_cast<Eigen::Index>(k)], planes.front(), planes.back());
    const auto cell = static_cast<std::uint32_t>(
        std::prev(std::upper_bound(planes.begin() + 1, planes.end() - 1, x)) - planes.begin());
    const double spacing = planes[cell + 1] - planes[cell], t = (x - planes[cell]) / spacing;
    first[k] = std::clamp(cell, 1u, count_[k] - 3) - 1;
    const std::uint32_t node = cell - first[k];  // 0, 1 or 2 of the four
    if (is_linear_) {
      (*weights[k])[node] = static_cast<float>(1 - t);
      (*weights[k])[node + 1] = static_cast<float>(t);
      (*derivatives[k])[node] = static_cast<float>(-1 / spacing);
      (*derivatives[k])[node + 1] = static_cast<float>(1 / spacing);
    } else {
      *weights[k] = cubic_weights(node + t);
      *derivatives[k] = cubic_slopes(node + t, spacing);
    }
  }
  p.base = slopes.base = first[0] + count_[0] * (first[1] + count_[1] * first[2]);
  return p;
}

bool RemainderTable::is_at_end(const Vec3& X, double within, std::size_t axis) const noexcept {
  const double x = X[static_cast<Eigen::Index>(axis)];
  const std::vector<double>& planes = planes_[axis];
  return x - within < planes[1] || x + within > planes[planes.size() - 2];
}

void RemainderTable::add_column(std::uint32_t node, std::size_t axis, float weight,
                                float* field) const noexcept {
  const std::size_t n = 3 * nodes();
  loops_.axpy(weight, &table_[(3 * std::size_t{node} + axis) * n], field, n);
}

void RemainderTable::add_held_column(std::uint32_t node, std::size_t axis, float weight,
                                     float* field) const noexcept {
  const std::size_t n = 3 * nodes();
  loops_.axpy(weight, &held_[(3 * std::size_t{node} + axis) * n], field, n);
}

}  // namespace brachy
