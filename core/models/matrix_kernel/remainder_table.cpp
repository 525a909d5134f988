#include "core/models/matrix_kernel/remainder_table.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/base/share_out.h"
#include "core/elasticity/kelvin.h"

namespace brachy {
namespace {

constexpr std::size_t kChunk = 32;  // nodes whose columns are made at once: what MeshSystem solves together

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
  bool is_mixed = false;  // some inner point lies in another
};

// A point or two beside a region's surface do not make a mixture: one lies a millimetre deep in another material.
bool is_deep_in(const ElasticBody& body, const Vec3& X, std::size_t material, std::span<double> shares) {
  constexpr double kDeep = 1;  // mm
  for (Eigen::Index k = 0; k < 6; ++k) {
    body.material_shares(X + (k % 2 ? kDeep : -kDeep) * Vec3::Unit(k / 2), shares);
    if (shares[material] < 1) return false;
  }
  return true;
}

Makeup makeup_of(const Tissue& tissue, const ElasticBody& body) {
  std::vector<double> total(body.regions.size() + 1), shares(total.size());
  const std::span inner = std::span(tissue.rest_vertices).subspan(tissue.surface_count);
  for (const Vec3& X : inner) {
    body.material_shares(X, shares);
    for (std::size_t m = 0; m < shares.size(); ++m) total[m] += shares[m];
  }
  Makeup makeup{static_cast<std::size_t>(std::ranges::max_element(total) - total.begin())};
  makeup.is_mixed = std::ranges::any_of(inner, [&](const Vec3& X) {
    body.material_shares(X, shares);
    const auto m = static_cast<std::size_t>(std::ranges::max_element(shares) - shares.begin());
    return m != makeup.main && is_deep_in(body, X, m, shares);
  });
  return makeup;
}

}  // namespace

RemainderTable::RemainderTable(const Tissue& tissue, const ElasticKernel& kernel, double spacing,
                               SimdTarget target, const SetUp& set_up)
    : loops_(near_loops(target)) {
  place_planes(tissue, kernel.remainder(), spacing);
  const Makeup makeup = makeup_of(tissue, kernel.body());
  near_weight_ = 1 / kernel.body().materials()[makeup.main];
  table_.resize(9 * nodes() * nodes());
  if (is_linear_)
    fill_by_columns(kernel, makeup.is_mixed, set_up);
  else
    fill(kernel);
}

void RemainderTable::place_planes(const Tissue& tissue, const Remainder* remainder, double spacing) {
  Vec3 min = tissue.rest_vertices.front(), max = min;
  for (const Vec3& X : tissue.rest_vertices) {
    min = min.cwiseMin(X);
    max = max.cwiseMax(X);
  }
  if (remainder) planes_ = remainder->planes();
  is_linear_ = !planes_[0].empty();
  const Vec3 extent = (max - min).cwiseMax(1e-3);
  const auto cells = [&](std::size_t k) {
    return std::max(3, static_cast<int>(std::ceil(extent[static_cast<Eigen::Index>(k)] / spacing)));
  };
  while (!is_linear_ && (cells(0) + 1.0) * (cells(1) + 1.0) * (cells(2) + 1.0) > kMaxSmoothNodes)
    spacing *= 1.02;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    std::vector<double>& p = planes_[k];
    if (is_linear_) {  // those that the tissue lies between, and four at least
      auto first = std::prev(std::upper_bound(p.begin() + 1, p.end() - 4, min[axis]));
      auto last = std::max(std::lower_bound(p.begin(), p.end() - 1, max[axis]) + 1, first + 4);
      p = std::vector<double>(first, last);
    } else {
      for (int i = 0; i <= cells(k); ++i) p.push_back(min[axis] + extent[axis] * i / cells(k));
    }
    count_[k] = static_cast<std::uint32_t>(p.size());
  }
}

// A remainder that is smooth is given by few sources: all columns at once.
void RemainderTable::fill(const ElasticKernel& kernel) {
  if (!kernel.remainder()) return;
  const double factor = 1 / kernel.body().shear_modulus;
  const PointGroups groups = PointGroups::single(positions(), 0);
  Remainder::Parts parts = kernel.remainder()->between(groups, groups);
  parts.held *= -near_weight_;
  if (parts.motion.size() > 0) parts.held += parts.motion;
  const Eigen::MatrixXd& D = parts.held;
  for (Eigen::Index j = 0; j < D.cols(); ++j)
    for (Eigen::Index i = 0; i < D.rows(); ++i)
      table_[static_cast<std::size_t>(j * D.rows() + i)] =
          static_cast<float>(0.5 * factor * (D(i, j) + D(j, i)));
}

// Of finite elements some nodes' columns at a time, which no other columns change. Q is not quite symmetric (10⁻⁴ to
// 3·10⁻³ of C): of a pair of nodes the one that is first in the system's order has the force. Where the tissue is
// mixed, all nodes are spread over a node's spacing (with those of the main material as points K is not definite), and
// D = P − wQ + (w − ŵ) G has the weights of their places.
void RemainderTable::fill_by_columns(const ElasticKernel& kernel, bool is_mixed, const SetUp& set_up) {
  const ElasticBody& body = kernel.body();
  const std::vector<Vec3> at = positions();
  double s = 0;
  std::vector<double> modulus(at.size(), 1 / near_weight_);
  if (is_mixed) {
    std::ranges::transform(at, modulus.begin(), [&](const Vec3& X) { return body.relative_modulus(X); });
    const Vec3 cell =
        (at.back() - at.front()).cwiseQuotient(Vec3(count_[0] - 1, count_[1] - 1, count_[2] - 1));
    s = 0.5 * cell.squaredNorm() / 3;
    smooth_s_ = 2 * s;
  } else if (!body.regions.empty()) {
    held_.resize(table_.size());
  }
  const std::vector<std::uint32_t> order = nodes_by_slices(*kernel.remainder());
  // The rows of a chunk's nodes and of all after it; the others are the same by symmetry.
  const auto fill_chunk = [&](std::size_t begin, std::size_t end) {
    const auto groups = [&](std::size_t last) {
      PointGroups some;
      for (std::size_t i = begin; i < last; ++i) {
        some.begin_group();
        some.add(at[order[i]], s, 1);
      }
      some.finish();
      return some;
    };
    const Remainder::Parts parts = kernel.remainder()->between(groups(order.size()), groups(end));
    const std::size_t chunk = end - begin;
    for (std::size_t q = 0; q < chunk; ++q)
      for (std::size_t p = q; begin + p < order.size(); ++p) {
        const std::uint32_t i = order[begin + p], j = order[begin + q];
        const auto row = static_cast<Eigen::Index>(3 * p), column = static_cast<Eigen::Index>(3 * q);
        Mat3 P = parts.motion.block<3, 3>(row, column), Q = parts.held.block<3, 3>(row, column);
        if (p < chunk) {
          P = 0.5 * (P + parts.motion.block<3, 3>(column, row).transpose());
          Q = 0.5 * (Q + parts.held.block<3, 3>(column, row).transpose());
        }
        const double w = 2 / (modulus[i] + modulus[j]);
        Mat3 D = P - w * Q;
        if (w != near_weight_) D += (w - near_weight_) * kelvin(at[i] - at[j], smooth_s_, body.poisson);
        set_pair(table_, i, j, D / body.shear_modulus);
        if (!held_.empty()) set_pair(held_, i, j, Q / body.shear_modulus);
      }
  };
  const std::size_t chunks = (order.size() + kChunk - 1) / kChunk;
  share_out(chunks, std::min(set_up.threads, chunks), [&](std::size_t i, std::size_t thread) {
    fill_chunk(i * kChunk, std::min((i + 1) * kChunk, order.size()));
    // Of chunks c the i-th takes about (c − i) of c²/2.
    const double left = 1 - static_cast<double>(i + 1) / static_cast<double>(chunks);
    if (thread == 0 && set_up.progress) set_up.progress(1 - left * left);
  });
}

void RemainderTable::set_pair(std::vector<float>& table, std::uint32_t i, std::uint32_t j,
                              const Mat3& D) const {
  const std::size_t n = 3 * nodes();
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b)
      table[(3 * j + b) * n + 3 * i + a] = table[(3 * i + a) * n + 3 * j + b] =
          static_cast<float>(D(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)));
}

// In the order of a mesh's system (HexMesh): along the axis with the most of its planes last.
std::vector<std::uint32_t> RemainderTable::nodes_by_slices(const Remainder& remainder) const {
  const auto planes = remainder.planes();
  std::array<std::size_t, 3> axes = {0, 1, 2};
  std::ranges::stable_sort(axes, {}, [&](std::size_t axis) { return planes[axis].size(); });
  std::vector<std::uint32_t> order;
  const std::uint32_t stride[] = {1, count_[0], count_[0] * count_[1]};
  for (std::uint32_t z = 0; z < count_[axes[2]]; ++z)
    for (std::uint32_t y = 0; y < count_[axes[1]]; ++y)
      for (std::uint32_t x = 0; x < count_[axes[0]]; ++x)
        order.push_back(x * stride[axes[0]] + y * stride[axes[1]] + z * stride[axes[2]]);
  return order;
}

std::vector<Vec3> RemainderTable::positions() const {
  std::vector<Vec3> at;
  for (std::uint32_t node = 0; node < nodes(); ++node) at.push_back(position(node));
  return at;
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

double RemainderTable::variance_of_nodes(const Vec3& X) const noexcept {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::vector<double>& planes = planes_[k];
    const double x = std::clamp(X[static_cast<Eigen::Index>(k)], planes.front(), planes.back());
    const auto above = std::upper_bound(planes.begin() + 1, planes.end() - 1, x);
    sum += (x - *std::prev(above)) * (*above - x);
  }
  return sum / 3;
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
