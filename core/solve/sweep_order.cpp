#include "core/solve/sweep_order.h"

#include <algorithm>
#include <Eigen/Eigenvalues>
#include <tuple>

#include "core/base/work_budget.h"

namespace brachy {
namespace {

constexpr int kWindow = SpeedThresholds::kSweepWindow;

}  // namespace

SweepOrder::SweepOrder(const AssemblyLoops& loops, int capacity) : loops_(loops) {
  const auto n = static_cast<std::size_t>(capacity);
  keys_.reserve(n);
  for (auto* v : {&x_, &y_, &z_}) v->reserve(n);
  window_.reserve(kWindow);
  order_.reserve(n);
  first_neighbours_.reserve(n);
}

void SweepOrder::compute(std::span<const Vec3> positions, double support_radius) noexcept {
  Vec3 centre = Vec3::Zero();
  for (const Vec3& p : positions) centre += p / static_cast<double>(positions.size());
  Mat3 spread = Mat3::Zero();
  for (const Vec3& p : positions) spread += (p - centre) * (p - centre).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(spread);
  sort_along(axes.eigenvectors().col(2), positions);
  find_reach(support_radius);
  find_first_neighbours(positions, support_radius);
  sort_windows();
  find_first_neighbours(positions, support_radius);
}

void SweepOrder::sort_along(const Vec3& direction, std::span<const Vec3> positions) noexcept {
  keys_.clear();
  for (int i = 0; i < static_cast<int>(positions.size()); ++i)
    keys_.emplace_back(direction.dot(positions[static_cast<std::size_t>(i)]), i);
  std::ranges::sort(keys_);  // ties are broken by the landmark's index
  order_.clear();
  for (const auto& key : keys_) order_.push_back(key.second);
}

// A bound by the sweep's coordinate alone: landmarks that lie behind by a or more are out of reach.
void SweepOrder::find_reach(double support_radius) noexcept {
  first_neighbours_.clear();
  int reach = 0;
  for (const auto& key : keys_) {
    while (key.first - keys_[static_cast<std::size_t>(reach)].first >= support_radius) ++reach;
    first_neighbours_.push_back(reach);
  }
}

// From the bounds that first_neighbours_ holds, which count windows, not rows.
void SweepOrder::find_first_neighbours(std::span<const Vec3> positions, double support_radius) noexcept {
  for (auto* v : {&x_, &y_, &z_}) v->clear();
  for (const int landmark : order_) {
    const Vec3& p = positions[static_cast<std::size_t>(landmark)];
    x_.push_back(p.x());
    y_.push_back(p.y());
    z_.push_back(p.z());
  }
  for (std::size_t i = 0; i < order_.size(); ++i)
    first_neighbours_[i] =
        loops_.first_within({x_.data(), y_.data(), z_.data()}, x_[i], y_[i], z_[i], support_radius,
                            first_neighbours_[i] / kWindow * kWindow, static_cast<int>(i));
}

// A panel of 16 rows is as wide as its widest, so rows that are close in the sweep and begin alike are grouped. In a
// volume this saves a twentieth of the operations.
void SweepOrder::sort_windows() noexcept {
  for (std::size_t begin = 0; begin < order_.size(); begin += kWindow) {
    const std::size_t end = std::min(begin + kWindow, order_.size());
    window_.clear();
    for (std::size_t i = begin; i < end; ++i) window_.emplace_back(first_neighbours_[i], order_[i]);
    std::ranges::sort(window_);
    for (std::size_t i = begin; i < end; ++i) std::tie(first_neighbours_[i], order_[i]) = window_[i - begin];
  }
}

double SweepOrder::fill_estimate() const {
  double operations = 0;
  for (std::size_t i = 0; i < first_neighbours_.size(); ++i) {
    const double width = static_cast<double>(i) - first_neighbours_[i];
    operations += width * width;
  }
  const auto n = static_cast<double>(first_neighbours_.size());
  return n > 0 ? operations / (n * n * n / 3) : 1;
}

}  // namespace brachy
