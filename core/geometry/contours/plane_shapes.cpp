#include "core/geometry/contours/plane_shapes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <unordered_map>

#include "core/base/error.h"
#include "core/geometry/contours/edge_grid.h"

namespace brachy {
namespace {

constexpr double kLeastShapeMm2 = 1e-6;

/// Gives points that lie within kSamePointMm of each other one number.
class PointNumbers {
 public:
  std::uint32_t of(const Vec2& p) {
    const auto x = static_cast<std::int64_t>(std::floor(p.x() / kSamePointMm)),
               y = static_cast<std::int64_t>(std::floor(p.y() / kSamePointMm));
    for (std::int64_t i = x - 1; i <= x + 1; ++i)
      for (std::int64_t j = y - 1; j <= y + 1; ++j) {
        const auto [from, to] = cells_.equal_range(key(i, j));
        for (auto at = from; at != to; ++at)
          if ((points_[at->second] - p).norm() <= kSamePointMm) return at->second;
      }
    const auto number = static_cast<std::uint32_t>(points_.size());
    points_.push_back(p);
    cells_.emplace(key(x, y), number);
    return number;
  }
  const std::vector<Vec2>& points() const { return points_; }

 private:
  static std::uint64_t key(std::int64_t i, std::int64_t j) {
    return static_cast<std::uint64_t>(i) * 0x9E3779B97F4A7C15U + static_cast<std::uint64_t>(j);
  }
  std::unordered_multimap<std::uint64_t, std::uint32_t> cells_;
  std::vector<Vec2> points_;
};

/// The contour by numbers of points, none twice in a row, and once round where it goes round several times.
std::vector<std::uint32_t> numbered(const Polygon& contour, PointNumbers& numbers) {
  std::vector<std::uint32_t> ids;
  for (const Vec2& p : contour)
    if (const std::uint32_t id = numbers.of(p); ids.empty() || ids.back() != id) ids.push_back(id);
  while (ids.size() > 1 && ids.back() == ids.front()) ids.pop_back();
  for (const std::size_t times : {5U, 3U, 2U})
    while (ids.size() >= 3 * times && ids.size() % times == 0 &&
           std::equal(ids.begin() + static_cast<std::ptrdiff_t>(ids.size() / times), ids.end(), ids.begin()))
      ids.resize(ids.size() / times);
  return ids;
}

double shoelace(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i + 1 < polygon.size(); ++i) {
    const Vec2 p = polygon[i] - polygon[0], q = polygon[i + 1] - polygon[0];
    twice += p.x() * q.y() - p.y() * q.x();
  }
  return 0.5 * twice;
}

double side_of(const Vec2& a, const Vec2& b, const Vec2& p) {
  return (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
}

/// Whether two edges cross within both; not where they only touch.
bool do_cross(const EdgeGrid::Edge& e, const EdgeGrid::Edge& f) {
  return side_of(e.a, e.b, f.a) * side_of(e.a, e.b, f.b) < 0 &&
         side_of(f.a, f.b, e.a) * side_of(f.a, f.b, e.b) < 0;
}

bool is_right_of(const Vec2& p, const Vec2& a, const Vec2& b) {
  return (a.y() <= p.y()) != (b.y() <= p.y()) &&
         a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()) > p.x();
}

/// Which polygons are joined by crossings: the first one of each group.
std::vector<std::size_t> crossing_groups(const EdgeGrid& grid, std::size_t count, const std::string& name,
                                         std::size_t& pairs) {
  std::vector<std::size_t> first(count);
  std::iota(first.begin(), first.end(), std::size_t{0});
  const auto root = [&](std::size_t n) {
    while (first[n] != n) n = first[n] = first[first[n]];
    return n;
  };
  for (std::size_t c = 0; c < grid.cell_count(); ++c) {
    const auto cell = grid.cell(c);
    pairs += cell.size() * cell.size() / 2;
    if (pairs > kMostPairs)
      throw UserError(name +
                      ": the contours of a plane run too close and too long beside each other; export them "
                      "with fewer points");
    for (std::size_t i = 0; i < cell.size(); ++i)
      for (std::size_t j = i + 1; j < cell.size(); ++j) {
        const auto &e = grid.edges()[cell[i]], &f = grid.edges()[cell[j]];
        if (e.polygon == f.polygon || root(e.polygon) == root(f.polygon) || !do_cross(e, f)) continue;
        const auto [low, high] = std::minmax({root(e.polygon), root(f.polygon)});
        first[high] = low;
      }
  }
  for (std::size_t n = 0; n < count; ++n) first[n] = root(n);
  return first;
}

/// Area and centroid by horizontal lines, even and odd: of contours that cross each other or themselves.
struct Measured {
  double area;
  Vec2 centroid;
};

Measured measured_by_lines(const PlaneShape& shape) {
  constexpr std::size_t kLines = 400;
  std::vector<std::vector<double>> crossings(kLines);
  const double low = shape.box.min().y(), step = shape.box.sizes().y() / kLines;
  for (const Polygon& polygon : shape.polygons)
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double from = (std::min(a.y(), b.y()) - low) / step - 0.5,
                   to = (std::max(a.y(), b.y()) - low) / step - 0.5;
      for (auto n = static_cast<std::size_t>(std::max(0.0, std::ceil(from)));
           n < kLines && static_cast<double>(n) < to; ++n) {
        const double y = low + step * (static_cast<double>(n) + 0.5);
        crossings[n].push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
      }
    }
  Measured sum{0, Vec2::Zero()};
  for (std::size_t n = 0; n < kLines; ++n) {
    std::ranges::sort(crossings[n]);
    for (std::size_t k = 0; k + 1 < crossings[n].size(); k += 2) {
      const double from = crossings[n][k], to = crossings[n][k + 1], area = (to - from) * step;
      sum.area += area;
      sum.centroid += area * Vec2(0.5 * (from + to), low + step * (static_cast<double>(n) + 0.5));
    }
  }
  if (sum.area > 0) sum.centroid /= sum.area;
  return sum;
}

void measure(PlaneShape& shape) {
  for (const Polygon& polygon : shape.polygons)
    for (const Vec2& p : polygon) shape.box.extend(p);
  const Measured lines = measured_by_lines(shape);
  shape.centroid = lines.area > 0 ? lines.centroid : Vec2(shape.box.center());
  shape.area_mm2 = lines.area;
  if (shape.polygons.size() > 1) return;
  // Exact where the contour does not cross itself.
  const double exact = std::abs(shoelace(shape.polygons.front()));
  if (std::abs(exact - lines.area) <= 0.02 * exact) shape.area_mm2 = exact;
}

void find_depths(std::vector<PlaneShape>& shapes, const EdgeGrid& grid,
                 const std::vector<std::size_t>& shape_of) {
  std::vector<char> is_inside(shapes.size());
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    const Polygon& polygon = shapes[s].polygons.front();
    const Vec2 at = 0.5 * (polygon[0] + polygon[1]);
    std::ranges::fill(is_inside, 0);
    grid.edges_beside(at, [&](const EdgeGrid::Edge& edge) {
      if (is_right_of(at, edge.a, edge.b)) is_inside[shape_of[edge.polygon]] ^= 1;
    });
    is_inside[s] = 0;
    shapes[s].depth = static_cast<std::size_t>(std::ranges::count(is_inside, 1));
  }
}

bool is_within(const Polygon& polygon, const EdgeGrid& other) {
  return std::ranges::all_of(polygon, [&](const Vec2& p) { return other.is_near(p, kRepeatedMm); });
}

}  // namespace

bool PlaneShape::contains(const Vec2& p) const {
  if (!box.contains(p)) return false;
  bool is_inside = false;
  for (const Polygon& polygon : polygons)
    for (std::size_t i = 0; i < polygon.size(); ++i)
      if (is_right_of(p, polygon[i], polygon[(i + 1) % polygon.size()])) is_inside = !is_inside;
  return is_inside;
}

double area_mm2(const std::vector<PlaneShape>& shapes) {
  double sum = 0;
  for (const PlaneShape& shape : shapes) sum += shape.is_hole() ? -shape.area_mm2 : shape.area_mm2;
  return sum;
}

std::vector<Polygon> simple_loops(const Polygon& contour) {
  PointNumbers numbers;
  const std::vector<std::uint32_t> ids = numbered(contour, numbers);
  // Each edge that is passed an even number of times falls out: what is inside by even and odd stays.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> passes;
  const auto edge = [&](std::size_t i) { return std::minmax(ids[i], ids[(i + 1) % ids.size()]); };
  for (std::size_t i = 0; i < ids.size(); ++i) ++passes[edge(i)];
  std::vector<std::vector<std::uint32_t>> neighbours(numbers.points().size());
  for (std::size_t i = ids.size(); i-- > 0;)
    if (auto& count = passes[edge(i)]; count % 2 != 0) {
      count = 0;
      const auto [a, b] = edge(i);
      neighbours[a].push_back(b);
      neighbours[b].push_back(a);
    }
  // Along the edges that are left; a loop is closed where the path comes to a point that it has.
  std::vector<Polygon> loops;
  std::vector<std::uint32_t> path;
  std::vector<std::uint32_t> place(numbers.points().size(), 0);  // in the path, + 1
  const auto take = [&](std::uint32_t from) {
    const std::uint32_t to = neighbours[from].back();
    neighbours[from].pop_back();
    auto& back = neighbours[to];
    back.erase(std::ranges::find(back, from));
    return to;
  };
  for (const std::uint32_t start : ids) {
    if (neighbours[start].empty()) continue;
    path = {start};
    place[start] = 1;
    while (!path.empty()) {
      if (neighbours[path.back()].empty()) {
        place[path.back()] = 0;
        path.pop_back();
        continue;
      }
      const std::uint32_t at = take(path.back());
      if (place[at] == 0) {
        path.push_back(at);
        place[at] = static_cast<std::uint32_t>(path.size());
        continue;
      }
      Polygon loop;
      for (std::size_t n = place[at] - 1; n < path.size(); ++n) loop.push_back(numbers.points()[path[n]]);
      for (std::size_t n = place[at]; n < path.size(); ++n) place[path[n]] = 0;
      path.resize(place[at]);
      if (loop.size() >= 3) loops.push_back(std::move(loop));
    }
  }
  return loops;
}

std::size_t drop_repeated(std::vector<Polygon>& polygons) {
  struct Outline {
    Eigen::AlignedBox2d box;
    std::size_t number;
  };
  std::vector<Outline> outlines(polygons.size());
  for (std::size_t n = 0; n < polygons.size(); ++n) {
    outlines[n].number = n;
    for (const Vec2& p : polygons[n]) outlines[n].box.extend(p);
  }
  std::ranges::stable_sort(outlines, {}, [](const Outline& o) { return o.box.min().x(); });
  std::vector<char> is_repeated(polygons.size(), 0);
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    std::optional<EdgeGrid> own;  // where another one has the same box
    for (std::size_t j = i + 1; j < outlines.size(); ++j) {
      const Outline &a = outlines[i], &b = outlines[j];
      if (b.box.min().x() - a.box.min().x() > kRepeatedMm) break;
      if ((a.box.min() - b.box.min()).cwiseAbs().maxCoeff() > kRepeatedMm ||
          (a.box.max() - b.box.max()).cwiseAbs().maxCoeff() > kRepeatedMm || is_repeated[a.number] != 0 ||
          is_repeated[b.number] != 0)
        continue;
      if (!own) own.emplace(std::span(&polygons[a.number], 1));
      if (is_within(polygons[b.number], *own) &&
          is_within(polygons[a.number], EdgeGrid(std::span(&polygons[b.number], 1))))
        is_repeated[std::max(a.number, b.number)] = 1;
    }
  }
  std::size_t kept = 0;
  for (std::size_t n = 0; n < polygons.size(); ++n)
    if (is_repeated[n] == 0) {
      if (kept != n) polygons[kept] = std::move(polygons[n]);
      ++kept;
    }
  const std::size_t dropped = polygons.size() - kept;
  polygons.resize(kept);
  return dropped;
}

std::vector<PlaneShape> plane_shapes(std::vector<Polygon> polygons, const std::string& name,
                                     std::size_t& pairs) {
  std::size_t points = 0;
  for (const Polygon& polygon : polygons) points += polygon.size();
  if (polygons.size() > kMostShapes || points > kMostPlanePoints)
    throw UserError(name + ": has over 2,000 contours or 100,000 points in a plane; export it with fewer");
  const EdgeGrid grid(polygons);
  const std::vector<std::size_t> first = crossing_groups(grid, polygons.size(), name, pairs);
  std::vector<PlaneShape> shapes;
  std::vector<std::size_t> shape_of(polygons.size());
  for (std::size_t n = 0; n < polygons.size(); ++n) {
    shape_of[n] = first[n] == n ? shapes.size() : shape_of[first[n]];
    if (first[n] == n) shapes.emplace_back();
    shapes[shape_of[n]].polygons.push_back(std::move(polygons[n]));
  }
  for (PlaneShape& shape : shapes) measure(shape);
  find_depths(shapes, grid, shape_of);
  std::erase_if(shapes, [](const PlaneShape& shape) { return !(shape.area_mm2 > kLeastShapeMm2); });
  return shapes;
}

}  // namespace brachy
