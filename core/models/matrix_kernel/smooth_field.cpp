#include "core/models/matrix_kernel/smooth_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace brachy {

SmoothField::SmoothField(const ElasticKernel& kernel, std::shared_ptr<const SmoothTables> tables,
                         SimdTarget target, std::size_t max_landmarks)
    : tables_(std::move(tables)),
      table_(tables_->remainder),
      columns_(kernel, table_, target, max_landmarks),
      loops_(near_loops(target)),
      node_field_(table_.field_size(), 0) {}

void SmoothField::set_forces(std::span<const Vec3> forces) noexcept {
  std::ranges::fill(node_field_, 0.0f);
  columns_.add_fields(forces, node_field_.data());
  measure_roughness();
}

void SmoothField::rescale(double scale) noexcept {
  for (float& u : node_field_) u *= static_cast<float>(scale);
  measure_roughness();
}

void SmoothField::interpolate(std::uint32_t b, const BlockPoints<float>& X,
                              BlockDisplacement<float>& u) const noexcept {
  const SmoothTables::BlockReading& block = tables_->blocks[b];
  const GridPoint* points = &tables_->grid_points[block.first];
  if (!block.is_parabola) {
    loops_.interpolate(node_field_.data(), table_.row(), table_.slice(), points, Tissue::kBlockSize, u);
    return;
  }
  loops_.interpolate(node_field_.data(), table_.row(), table_.slice(), points, SmoothTables::kStencil, u);
  const auto at = [&](std::size_t i) { return Eigen::Vector3f(u.ux[i], u.uy[i], u.uz[i]); };
  const Eigen::Vector3f here = at(0), &half = block.half;
  std::array<Eigen::Vector3f, 3> slope, bend, twist;
  for (std::size_t k = 0; k < 3; ++k) {
    slope[k] = 0.5f * (at(1 + 2 * k) - at(2 + 2 * k));
    bend[k] = 0.5f * (at(1 + 2 * k) + at(2 + 2 * k)) - here;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    twist[k] = at(7 + k) - here - slope[k] - slope[next] - bend[k] - bend[next];
  }
  float q[SmoothTables::kStencil][3];
  const auto put = [&](std::size_t row, const Eigen::Vector3f& v) { std::copy_n(v.data(), 3, q[row]); };
  put(0, here);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<Eigen::Index>(k), j = (i + 1) % 3;
    put(1 + k, slope[k] / half[i]);
    put(4 + k, bend[k] / (half[i] * half[i]));
    put(7 + k, twist[k] / (half[i] * half[j]));
  }
  loops_.quadratic(X, q, u);
}

void SmoothField::add_displacement_at(const Vec3& X, Vec3& u) const noexcept {
  const GridPoint p = table_.locate(X);
  for (std::size_t z = 0; z < 4; ++z)
    for (std::size_t y = 0; y < 4; ++y)
      for (std::size_t x = 0; x < 4; ++x) {
        const float* v = &node_field_[3 * std::size_t{table_.node(p, x, y, z)}];
        u += static_cast<double>(p.wx[x] * p.wy[y] * p.wz[z]) * Vec3(v[0], v[1], v[2]);
      }
}

Mat3 SmoothField::gradient_at(const Vec3& X) const noexcept {
  GridPoint d;
  const GridPoint p = table_.locate(X, d);
  Eigen::Matrix3f A = Eigen::Matrix3f::Zero();
  for (std::size_t z = 0; z < 4; ++z)
    for (std::size_t y = 0; y < 4; ++y) {
      const float* v = &node_field_[3 * std::size_t{table_.node(p, 0, y, z)}];
      Eigen::Vector3f value = Eigen::Vector3f::Zero(), slope = value;
      for (std::size_t x = 0; x < 4; ++x) {
        const Eigen::Map<const Eigen::Vector3f> u(v + 3 * x);
        value += p.wx[x] * u;
        slope += d.wx[x] * u;
      }
      A.col(0) += p.wz[z] * p.wy[y] * slope;
      A.col(1) += p.wz[z] * d.wy[y] * value;
      A.col(2) += d.wz[z] * p.wy[y] * value;
    }
  return A.cast<double>();
}

// Along an axis Lagrange's weights sum to at most kSum in size, those of the first difference to kFirst, of
// the second to kSecond: in the middle of their four nodes, and in a cell at the grid's end.
constexpr double kSum[2] = {1.25, 1.64}, kFirst[2] = {4.0 / 3, 10.0 / 3}, kSecond[2] = {1, 3};

// The greatest second differences along an axis (bend_) and across two (twist_) over the nodes' spacings
// squared; and how much the slope may jump from one cell to the next (jump_): by a sixth of the fourth
// difference between Lagrange's cubics, by the second difference between trilinear cells.
void SmoothField::measure_roughness() noexcept {
  bend_ = twist_ = jump_ = steepest_ = 0;
  std::array<double, 3> slope{};
  const auto count = table_.counts();
  const std::array<std::size_t, 3> stride = {3, table_.row(), table_.slice()};
  const auto value = [&](const float* v) { return Eigen::Vector3f(v[0], v[1], v[2]); };
  std::array<std::uint32_t, 3> at{};
  for (at[2] = 0; at[2] < count[2]; ++at[2])
    for (at[1] = 0; at[1] < count[1]; ++at[1])
      for (at[0] = 0; at[0] < count[0]; ++at[0]) {
        const float* v = &node_field_[at[0] * stride[0] + at[1] * stride[1] + at[2] * stride[2]];
        for (std::size_t k = 0; k < 3; ++k) {
          if (at[k] + 1 < count[k]) {
            const double spacing = table_.planes(k)[at[k] + 1] - table_.planes(k)[at[k]];
            slope[k] =
                std::max(slope[k], static_cast<double>((value(v + stride[k]) - value(v)).norm()) / spacing);
          }
          if (at[k] + 2 >= count[k]) continue;
          const std::size_t s = stride[k], next = (k + 1) % 3;
          const double h = table_.planes(k)[at[k] + 1] - table_.planes(k)[at[k]];
          const auto second = static_cast<double>((value(v) - 2 * value(v + s) + value(v + 2 * s)).norm());
          bend_ = std::max(bend_, second / (h * h));
          if (table_.is_linear()) {
            jump_ = std::max(jump_, second / h);
          } else if (at[k] + 4 < count[k]) {
            const auto fourth = static_cast<double>(
                (value(v) - 4 * value(v + s) + 6 * value(v + 2 * s) - 4 * value(v + 3 * s) + value(v + 4 * s))
                    .norm());
            jump_ = std::max(jump_, fourth / (6 * h));
          }
          if (at[next] + 1 >= count[next]) continue;
          const double g = table_.planes(next)[at[next] + 1] - table_.planes(next)[at[next]];
          const std::size_t t = stride[next];
          const auto mixed =
              static_cast<double>((value(v + s + t) - value(v + s) - value(v + t) + value(v)).norm());
          twist_ = std::max(twist_, mixed / (h * g));
        }
      }
  if (table_.is_linear()) {
    for (const double along : slope) steepest_ += along;
    return;
  }
  // A slope is a first difference and, by at most kFromFirst each, those of second order beside it: Lagrange's weights
  // and their slopes sum to 1 and 0.
  constexpr double kFromFirst = 1.2;
  double widest = 0;
  for (std::size_t k = 0; k < 3; ++k) widest = std::max(widest, table_.planes(k)[1] - table_.planes(k)[0]);
  for (const double along : slope)
    steepest_ += along + kFromFirst * widest * (kSum[1] * kSum[1] * bend_ + (1 + kSum[1]) * twist_);
}

double SmoothField::gradient_varies(const Vec3& X, double half) const noexcept {
  std::array<std::size_t, 3> end{};
  double narrowest = 1e30;
  for (std::size_t k = 0; k < 3; ++k) {
    end[k] = table_.is_at_end(X, half, k) ? 1 : 0;
    narrowest = std::min(narrowest, table_.planes(k)[1] - table_.planes(k)[0]);
  }
  const double crossings = 1 + std::floor(half / narrowest);
  if (table_.is_linear()) return 3 * (2 * half * twist_ + crossings * jump_);
  double sum = 0;
  for (std::size_t j = 0; j < 3; ++j) {
    const std::size_t k = (j + 1) % 3, l = (j + 2) % 3;
    sum += half * bend_ * kSecond[end[j]] * kSum[end[k]] * kSum[end[l]];
    sum += half * twist_ * kFirst[end[j]] * (kFirst[end[k]] * kSum[end[l]] + kFirst[end[l]] * kSum[end[k]]);
    sum += crossings * jump_ * kSum[end[k]] * kSum[end[l]];
  }
  return sum;
}

void SmoothField::add_bounds(const Cell& cell, CellBounds& bounds) const noexcept {
  const Mat3 here = gradient_at(cell.centre);
  const double varies = gradient_varies(cell.centre, cell.half);
  bounds.slope += here.rowwise().norm().sum() + varies;
  bounds.squeeze += 0.5 * (here + here.transpose()).norm() + varies;
  bounds.shrink += std::max(0.0, -here.trace()) + varies;
  bounds.rounding += varies;
}

std::size_t SmoothField::bytes() const {
  return tables_->bytes() + columns_.bytes();
}

}  // namespace brachy
