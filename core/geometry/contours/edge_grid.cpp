#include "core/geometry/contours/edge_grid.h"

#include <algorithm>
#include <cmath>

namespace brachy {

double distance_to_edge(const Vec2& a, const Vec2& b, const Vec2& p) {
  const Vec2 d = b - a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0;
  return (a + t * d - p).norm();
}

EdgeGrid::EdgeGrid(std::span<const Polygon> polygons) {
  for (std::uint32_t n = 0; n < polygons.size(); ++n)
    for (std::size_t i = 0; i < polygons[n].size(); ++i) {
      edges_.push_back({polygons[n][i], polygons[n][(i + 1) % polygons[n].size()], n});
      box_.extend(polygons[n][i]);
    }
  if (edges_.empty()) box_.extend(Vec2::Zero());
  const Vec2 size = box_.sizes().cwiseMax(1e-6);
  // A long strip gets cells of the same number; at most 4,096 a side.
  pitch_ = std::max(std::sqrt(size.x() * size.y() / static_cast<double>(edges_.size() + 1)),
                    size.maxCoeff() / 4096);
  columns_ = static_cast<std::size_t>(size.x() / pitch_) + 1;
  rows_ = static_cast<std::size_t>(size.y() / pitch_) + 1;
  std::vector<std::size_t> counts(columns_ * rows_ + 1, 0);
  for (const Edge& edge : edges_) walk(edge, [&](std::size_t cell) { ++counts[cell + 1]; });
  begins_ = counts;
  for (std::size_t n = 1; n < begins_.size(); ++n) begins_[n] += begins_[n - 1];
  items_.resize(begins_.back());
  std::vector<std::size_t> next = begins_;
  by_row_.resize(rows_);
  for (std::uint32_t e = 0; e < edges_.size(); ++e) {
    walk(edges_[e], [&](std::size_t cell) { items_[next[cell]++] = e; });
    const auto [low, high] = std::minmax({row_of(edges_[e].a.y()), row_of(edges_[e].b.y())});
    for (std::size_t row = low; row <= high; ++row) by_row_[row].push_back(e);
  }
}

std::size_t EdgeGrid::column_of(double x) const {
  return static_cast<std::size_t>(
      std::clamp((x - box_.min().x()) / pitch_, 0.0, static_cast<double>(columns_ - 1)));
}

std::size_t EdgeGrid::row_of(double y) const {
  return static_cast<std::size_t>(
      std::clamp((y - box_.min().y()) / pitch_, 0.0, static_cast<double>(rows_ - 1)));
}

/// Row by row, the columns between those where the edge enters and leaves it.
template <class Visit>
void EdgeGrid::walk(const Edge& edge, Visit visit) const {
  const auto [low, high] = std::minmax({row_of(edge.a.y()), row_of(edge.b.y())});
  const Vec2 d = edge.b - edge.a;
  for (std::size_t row = low; row <= high; ++row) {
    double from = edge.a.x(), to = edge.b.x();
    if (low != high) {
      const double y = box_.min().y() + pitch_ * static_cast<double>(row);
      from = edge.a.x() + d.x() * std::clamp((y - edge.a.y()) / d.y(), 0.0, 1.0);
      to = edge.a.x() + d.x() * std::clamp((y + pitch_ - edge.a.y()) / d.y(), 0.0, 1.0);
    }
    const double slack = 1e-9 * pitch_;
    const std::size_t first = column_of(std::min(from, to) - slack),
                      last = column_of(std::max(from, to) + slack);
    for (std::size_t column = first; column <= last; ++column) visit(row * columns_ + column);
  }
}

bool EdgeGrid::is_near(const Vec2& p, double most_mm) const {
  if (box_.exteriorDistance(p) > most_mm) return false;
  const std::size_t first = column_of(p.x() - most_mm), last = column_of(p.x() + most_mm);
  for (std::size_t row = row_of(p.y() - most_mm); row <= row_of(p.y() + most_mm); ++row)
    for (std::size_t column = first; column <= last; ++column)
      for (const std::uint32_t e : cell(row * columns_ + column))
        if (distance_to_edge(edges_[e].a, edges_[e].b, p) <= most_mm) return true;
  return false;
}

}  // namespace brachy
