#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/contours/plane_shapes.h"

namespace brachy {

/// The edges of polygons by the square cells that they pass, about as many cells as edges: what lies near a point is
/// found without a look at all of them.
class EdgeGrid {
 public:
  struct Edge {
    Vec2 a, b;
    std::uint32_t polygon;
  };

  explicit EdgeGrid(std::span<const Polygon> polygons);

  const std::vector<Edge>& edges() const { return edges_; }
  std::size_t cell_count() const { return columns_ * rows_; }
  /// Indices of the edges that pass cell n.
  std::span<const std::uint32_t> cell(std::size_t n) const {
    return {items_.data() + begins_[n], begins_[n + 1] - begins_[n]};
  }
  /// Whether an edge passes within `most_mm` of the point.
  bool is_near(const Vec2& p, double most_mm) const;
  /// Calls visit(edge) for each edge whose span in y may hold p.y() and that may lie at larger x: with repetitions left
  /// out.
  template <class Visit>
  void edges_beside(const Vec2& p, Visit visit) const {
    for (const std::uint32_t e : by_row_[row_of(p.y())]) visit(edges_[e]);
  }

 private:
  std::size_t column_of(double x) const;
  std::size_t row_of(double y) const;
  template <class Visit>
  void walk(const Edge& edge, Visit visit) const;

  std::vector<Edge> edges_;
  Eigen::AlignedBox2d box_;
  double pitch_ = 1;
  std::size_t columns_ = 1, rows_ = 1;
  std::vector<std::size_t> begins_;
  std::vector<std::uint32_t> items_;
  std::vector<std::vector<std::uint32_t>> by_row_;
};

/// From a point to the nearest one of an edge, mm.
double distance_to_edge(const Vec2& a, const Vec2& b, const Vec2& p);

}  // namespace brachy
