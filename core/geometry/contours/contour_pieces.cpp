#include "core/geometry/contours/contour_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "core/base/error.h"

namespace brachy {
namespace {

/// A shape of a plane that is no hole, with its holes; or a hole.
struct Body {
  std::size_t plane;
  std::vector<const PlaneShape*> shapes;  ///< the outline first
  std::size_t parent;                     ///< of a hole: the body that has it; else itself
  bool is_hole;
  std::vector<std::size_t> above{},
      below{};  ///< bodies of the next plane, and of the last, that it goes on in

  const PlaneShape& outline() const { return *shapes.front(); }
  double diameter_mm() const { return 2 * std::sqrt(outline().area_mm2 / std::numbers::pi); }
};

/// The first body of each one's piece.
std::vector<std::size_t> first_of_pieces(const std::vector<Body>& bodies) {
  std::vector<std::size_t> first(bodies.size());
  std::iota(first.begin(), first.end(), std::size_t{0});
  const auto root = [&](std::size_t n) {
    while (first[n] != n) n = first[n] = first[first[n]];
    return n;
  };
  for (std::size_t a = 0; a < bodies.size(); ++a)
    for (const std::size_t b : bodies[a].above) {
      const auto [low, high] = std::minmax({root(a), root(b)});
      first[high] = low;
    }
  for (std::size_t n = 0; n < bodies.size(); ++n) first[n] = root(n);
  return first;
}

struct Range {
  std::size_t begin, end;
};

class Bodies {
 public:
  Bodies(const ContourStack& stack, const std::string& name) : stack_(stack), name_(name) {
    for (std::size_t p = 0; p < stack.planes.size(); ++p) add(p);
    nearest_.resize(bodies_.size());
    for (std::size_t p = 0; p + 1 < stack.planes.size(); ++p) {
      if (stack.is_piece_end(p)) continue;
      join_overlapping(p);
      find_nearest(p);
    }
    join_nearest();
    take_cavities();
  }
  /// Holes are among them only where they are a cavity's.
  const std::vector<Body>& all() const { return bodies_; }

 private:
  /// The shift to the nearest body above, where that is nearest to this one, too.
  struct Nearest {
    std::size_t above;
    Vec2 shift_per_mm;
  };

  void add(std::size_t plane);
  bool do_overlap(const Body& a, const Body& b);
  void join_overlapping(std::size_t plane);
  void find_nearest(std::size_t plane);
  void join_nearest();
  void join(std::size_t a, std::size_t above) {
    bodies_[a].above.push_back(above);
    bodies_[above].below.push_back(a);
  }
  void take_cavities();
  bool is_closed(std::size_t hole) const;
  bool is_steady(std::size_t body, const std::vector<std::optional<std::size_t>>& below) const;

  const ContourStack& stack_;
  const std::string& name_;
  std::vector<Body> bodies_;
  std::vector<Range> planes_;
  std::vector<std::optional<Nearest>> nearest_;
  std::size_t work_ = 0;  // edges that were looked at
};

void Bodies::add(std::size_t plane) {
  const std::vector<PlaneShape>& shapes = stack_.planes[plane].shapes;
  const std::size_t begin = bodies_.size();
  for (const PlaneShape& shape : shapes)
    if (!shape.is_hole()) bodies_.push_back({plane, {&shape}, bodies_.size(), false});
  const std::size_t end = bodies_.size();
  for (const PlaneShape& shape : shapes) {
    if (!shape.is_hole()) continue;
    const Vec2 at = 0.5 * (shape.polygons.front()[0] + shape.polygons.front()[1]);
    for (std::size_t b = begin; b < end; ++b)
      if (bodies_[b].outline().depth + 1 == shape.depth && bodies_[b].outline().contains(at)) {
        bodies_[b].shapes.push_back(&shape);
        bodies_.push_back({plane, {&shape}, b, true});
        break;
      }
  }
  planes_.push_back({begin, bodies_.size()});
}

/// Where a line of constant y passes through the body, from each odd one to the next.
std::vector<double> crossings(const Body& body, double y) {
  std::vector<double> xs;
  for (const PlaneShape* shape : body.shapes) {
    if (y < shape->box.min().y() || y > shape->box.max().y()) continue;
    for (const Polygon& polygon : shape->polygons)
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vec2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        if ((a.y() <= y) != (b.y() <= y))
          xs.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
      }
  }
  std::ranges::sort(xs);
  return xs;
}

bool do_meet(const std::vector<double>& a, const std::vector<double>& b) {
  for (std::size_t i = 0, j = 0; i + 1 < a.size() && j + 1 < b.size();) {
    if (std::min(a[i + 1], b[j + 1]) > std::max(a[i], b[j])) return true;
    a[i + 1] < b[j + 1] ? i += 2 : j += 2;
  }
  return false;
}

bool Bodies::do_overlap(const Body& a, const Body& b) {
  constexpr std::size_t kLines = 24, kMostWork = 4'000'000'000;
  const Eigen::AlignedBox2d both = a.outline().box.intersection(b.outline().box);
  if (both.isEmpty()) return false;
  for (std::size_t n = 0; n < kLines; ++n) {
    const double y =
        both.min().y() + (static_cast<double>(n) + 0.5) / static_cast<double>(kLines) * both.sizes().y();
    for (const Body* body : {&a, &b})
      for (const PlaneShape* shape : body->shapes)
        for (const Polygon& polygon : shape->polygons) work_ += polygon.size();
    if (work_ > kMostWork)
      throw UserError(name_ + ": too many contours lie over each other; export them with fewer points");
    if (do_meet(crossings(a, y), crossings(b, y))) return true;
  }
  return false;
}

void Bodies::join_overlapping(std::size_t plane) {
  for (std::size_t a = planes_[plane].begin; a < planes_[plane].end; ++a)
    for (std::size_t b = planes_[plane + 1].begin; b < planes_[plane + 1].end; ++b)
      if (bodies_[a].is_hole == bodies_[b].is_hole && do_overlap(bodies_[a], bodies_[b])) join(a, b);
}

void Bodies::find_nearest(std::size_t plane) {
  constexpr double kAlike = 4;  // times the area
  const auto [from, to] = planes_[plane];
  const auto [above_from, above_to] = planes_[plane + 1];
  const auto distance = [&](std::size_t a, std::size_t b) {
    return (bodies_[a].outline().centroid - bodies_[b].outline().centroid).norm();
  };
  constexpr auto kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> nearest_below(above_to - above_from, kNone), nearest_above(to - from, kNone);
  for (std::size_t a = from; a < to; ++a) {
    if (bodies_[a].is_hole || !bodies_[a].above.empty()) continue;
    for (std::size_t b = above_from; b < above_to; ++b) {
      if (bodies_[b].is_hole || !bodies_[b].below.empty()) continue;
      auto &above = nearest_above[a - from], &below = nearest_below[b - above_from];
      if (above == kNone || distance(a, b) < distance(a, above)) above = b;
      if (below == kNone || distance(a, b) < distance(below, b)) below = a;
    }
  }
  for (std::size_t a = from; a < to; ++a) {
    const std::size_t b = nearest_above[a - from];
    if (b == kNone || nearest_below[b - above_from] != a) continue;
    const double ratio = bodies_[a].outline().area_mm2 / bodies_[b].outline().area_mm2;
    if (ratio > kAlike || ratio < 1 / kAlike) continue;
    nearest_[a] = {b, (bodies_[b].outline().centroid - bodies_[a].outline().centroid) / stack_.gap_mm(plane)};
  }
}

/// Whether the way to the nearest body above is the way that is taken before or after it.
bool Bodies::is_steady(std::size_t body, const std::vector<std::optional<std::size_t>>& below) const {
  constexpr double kOfWay = 0.25, kOfDiameter = 0.5;
  const std::size_t above = nearest_[body]->above;
  const Vec2 way = nearest_[body]->shift_per_mm;
  const double gap = stack_.gap_mm(bodies_[body].plane);
  const auto is_alike = [&](const std::optional<Nearest>& other) {
    return other && gap * (other->shift_per_mm - way).norm() <
                        kOfWay * gap * way.norm() + kOfDiameter * bodies_[body].diameter_mm();
  };
  return is_alike(nearest_[above]) || (below[body] && is_alike(nearest_[*below[body]]));
}

void Bodies::join_nearest() {
  std::vector<std::optional<std::size_t>> below(bodies_.size());
  for (std::size_t a = 0; a < bodies_.size(); ++a)
    if (nearest_[a]) below[nearest_[a]->above] = a;
  for (std::size_t a = 0; a < bodies_.size(); ++a) {
    if (!nearest_[a]) continue;
    const Body& b = bodies_[nearest_[a]->above];
    const double apart = bodies_[a].outline().box.exteriorDistance(b.outline().box);
    if (apart < 0.5 * (bodies_[a].diameter_mm() + b.diameter_mm()) || is_steady(a, below))
      join(a, nearest_[a]->above);
  }
}

/// Whether a hole that ends, above or below, ends within what surrounds it.
bool Bodies::is_closed(std::size_t hole) const {
  const Body &body = bodies_[hole], &parent = bodies_[body.parent];
  const auto is_covered = [&](const std::vector<std::size_t>& next) {
    return std::ranges::any_of(next, [&](std::size_t n) {
      return std::ranges::all_of(body.outline().polygons, [&](const Polygon& polygon) {
        return std::ranges::all_of(polygon, [&](const Vec2& p) { return bodies_[n].outline().contains(p); });
      });
    });
  };
  return (!body.above.empty() || is_covered(parent.above)) &&
         (!body.below.empty() || is_covered(parent.below));
}

void Bodies::take_cavities() {
  const std::vector<std::size_t> first = first_of_pieces(bodies_);
  std::vector<char> is_open(bodies_.size(), 0);  // by the first of a piece
  for (std::size_t n = 0; n < bodies_.size(); ++n)
    if (bodies_[n].is_hole && !is_closed(n)) is_open[first[n]] = 1;
  std::vector<std::size_t> number(bodies_.size());  // of those that are kept
  std::vector<Body> kept;
  for (std::size_t n = 0; n < bodies_.size(); ++n) {
    number[n] = kept.size();
    if (bodies_[n].is_hole && is_open[first[n]] != 0) continue;
    kept.push_back(bodies_[n]);
    if (bodies_[n].is_hole) std::erase(kept[number[bodies_[n].parent]].shapes, &bodies_[n].outline());
  }
  for (Body& body : kept)
    for (std::size_t& above : body.above) above = number[above];
  bodies_ = std::move(kept);
}

/// How the bodies of a piece move from a plane to the next, by their areas; 0 where they branch.
Vec2 shift_above(const std::vector<Body>& bodies, const std::vector<std::size_t>& here,
                 const std::vector<std::size_t>& next) {
  Vec2 sum = Vec2::Zero();
  double areas = 0;
  std::vector<std::size_t> met;
  for (const std::size_t a : here) {
    if (bodies[a].above.size() != 1) return Vec2::Zero();
    const std::size_t b = bodies[a].above.front();
    met.push_back(b);
    const double area = bodies[a].outline().area_mm2 + bodies[b].outline().area_mm2;
    sum += area * (bodies[b].outline().centroid - bodies[a].outline().centroid);
    areas += area;
  }
  std::ranges::sort(met);
  return met == next ? Vec2(sum / areas) : Vec2(Vec2::Zero());
}

PiecePlane plane_of(const ContourStack& stack, const std::vector<Body>& bodies,
                    const std::vector<std::size_t>& here, const Vec2& offset) {
  PiecePlane plane;
  plane.height_mm = stack.planes[bodies[here.front()].plane].height_mm;
  plane.offset = offset;
  for (const std::size_t b : here) {
    for (const PlaneShape* shape : bodies[b].shapes) {
      plane.area_mm2 += shape == bodies[b].shapes.front() ? shape->area_mm2 : -shape->area_mm2;
      for (Polygon polygon : shape->polygons) {
        for (std::size_t i = 0; i < polygon.size(); ++i)
          plane.perimeter_mm += (polygon[(i + 1) % polygon.size()] - polygon[i]).norm();
        for (Vec2& p : polygon) p -= offset;
        plane.polygons.push_back(std::move(polygon));
      }
    }
  }
  return plane;
}

}  // namespace

std::vector<ContourPiece> contour_pieces(const ContourStack& stack, const std::string& name) {
  const Bodies joined(stack, name);
  const std::vector<Body>& bodies = joined.all();
  const std::vector<std::size_t> first = first_of_pieces(bodies);
  std::map<std::size_t, std::map<std::size_t, std::vector<std::size_t>>> by_piece;  // and plane
  for (std::size_t n = 0; n < bodies.size(); ++n) by_piece[first[n]][bodies[n].plane].push_back(n);
  std::vector<ContourPiece> pieces;
  for (const auto& [root, planes] : by_piece) {
    ContourPiece& piece = pieces.emplace_back();
    piece.is_cavity = bodies[root].is_hole;
    Vec2 offset = Vec2::Zero();
    for (auto at = planes.begin(); at != planes.end(); ++at) {
      piece.planes.push_back(plane_of(stack, bodies, at->second, offset));
      if (const auto next = std::next(at); next != planes.end())
        offset += shift_above(bodies, at->second, next->second);
    }
  }
  return pieces;
}

}  // namespace brachy
