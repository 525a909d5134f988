#include "core/ladder/remainder_table.h"

#include <algorithm>
#include <cmath>

#include "core/ladder/kelvin.h"

namespace brachy {
namespace {

// Lagrange's weights of four nodes at 0, 1, 2, 3 for t in [0, 3].
std::array<float, 4> cubic_weights(double t) {
  const double a = t, b = t - 1, c = t - 2, d = t - 3;
  return {static_cast<float>(-b * c * d / 6), static_cast<float>(a * c * d / 2),
          static_cast<float>(-a * b * d / 2), static_cast<float>(a * b * c / 6)};
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
  Vec3 max = min_ = tissue.rest_vertices.front();
  for (const Vec3& X : tissue.rest_vertices) {
    min_ = min_.cwiseMin(X);
    max = max.cwiseMax(X);
  }
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double extent = std::max(max[k] - min_[k], 1e-3);
    const auto n = std::max(4.0, std::ceil(extent / spacing) + 1);
    count_[static_cast<std::size_t>(k)] = static_cast<std::uint32_t>(n);
    spacing_[k] = extent / (n - 1);
  }
  std::vector<Vec3> at;
  at.reserve(nodes());
  for (std::uint32_t node = 0; node < nodes(); ++node) at.push_back(position(node));

  const ElasticBody& body = kernel.body();
  const Makeup makeup = makeup_of(tissue, body);
  material_ = makeup.main;
  near_weight_ = 1 / body.materials()[makeup.main];
  const double s = makeup.is_mixed ? 0.5 * spacing_.squaredNorm() / 3 : 0;
  const PointGroups groups = PointGroups::single(at, s);
  Eigen::MatrixXd D;
  if (makeup.is_mixed) {
    D = kernel.between(groups, groups);
    for (std::size_t i = 0; i < at.size(); ++i)
      for (std::size_t j = 0; j < at.size(); ++j)
        D.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) -=
            near_weight_ / body.shear_modulus * kelvin(at[i] - at[j], 2 * s, body.poisson);
  } else if (kernel.remainder()) {
    Remainder::Parts parts = kernel.remainder()->between(groups, groups);
    D = -near_weight_ * std::move(parts.held);
    if (parts.motion.size() > 0) D += parts.motion;
    D /= body.shear_modulus;
  }
  const auto n = static_cast<Eigen::Index>(3 * at.size());
  table_.resize(static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
  for (Eigen::Index j = 0; j < (D.size() > 0 ? n : 0); ++j)
    for (Eigen::Index i = 0; i < n; ++i)
      table_[static_cast<std::size_t>(j * n + i)] = static_cast<float>(0.5 * (D(i, j) + D(j, i)));
}

bool RemainderTable::covers(const Vec3& X) const noexcept {
  constexpr double kSlack = 0.5;  // mm: a contact lies on the surface, an entry a hair outside
  const Vec3 cells(count_[0] - 1.0, count_[1] - 1.0, count_[2] - 1.0);
  const Vec3 half = 0.5 * cells.cwiseProduct(spacing_);
  return ((X - min_ - half).cwiseAbs() - half).maxCoeff() <= kSlack;
}

Vec3 RemainderTable::position(std::uint32_t node) const noexcept {
  const std::uint32_t x = node % count_[0], y = node / count_[0] % count_[1],
                      z = node / count_[0] / count_[1];
  return min_ + Vec3(x, y, z).cwiseProduct(spacing_);
}

GridPoint RemainderTable::locate(const Vec3& X) const noexcept {
  GridPoint p;
  std::array<std::array<float, 4>*, 3> weights = {&p.wx, &p.wy, &p.wz};
  std::array<std::uint32_t, 3> first{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const double t = std::clamp((X[axis] - min_[axis]) / spacing_[axis], 0.0, count_[k] - 1.0);
    first[k] = static_cast<std::uint32_t>(std::clamp(std::floor(t) - 1, 0.0, count_[k] - 4.0));
    *weights[k] = cubic_weights(t - first[k]);
  }
  p.base = first[0] + count_[0] * (first[1] + count_[1] * first[2]);
  return p;
}

void RemainderTable::add_column(std::uint32_t node, std::size_t axis, float weight,
                                float* field) const noexcept {
  const std::size_t n = 3 * nodes();
  loops_.axpy(weight, &table_[(3 * std::size_t{node} + axis) * n], field, n);
}

}  // namespace brachy
