#include "core/rbf/sweep_order.h"

#include <algorithm>
#include <Eigen/Eigenvalues>

namespace brachy {

SweepOrder::SweepOrder(int capacity) {
  const auto n = static_cast<std::size_t>(capacity);
  keys_.reserve(n);
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
  find_first_neighbours(positions, support_radius);
}

void SweepOrder::sort_along(const Vec3& direction, std::span<const Vec3> positions) noexcept {
  keys_.clear();
  for (int i = 0; i < static_cast<int>(positions.size()); ++i)
    keys_.emplace_back(direction.dot(positions[static_cast<std::size_t>(i)]), i);
  std::ranges::sort(keys_);  // the landmark's number decides between equal places
  order_.clear();
  for (const auto& key : keys_) order_.push_back(key.second);
}

void SweepOrder::find_first_neighbours(std::span<const Vec3> positions, double support_radius) noexcept {
  first_neighbours_.clear();
  std::size_t reach = 0;  // first row that the sweep's coordinate leaves within a of row i
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    const Vec3& p = positions[static_cast<std::size_t>(order_[i])];
    while (keys_[i].first - keys_[reach].first >= support_radius) ++reach;
    std::size_t j = reach;
    while (j < i && (positions[static_cast<std::size_t>(order_[j])] - p).squaredNorm() >=
                        support_radius * support_radius)
      ++j;
    first_neighbours_.push_back(static_cast<int>(j));
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
