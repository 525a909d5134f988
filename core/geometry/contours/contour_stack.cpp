#include "core/geometry/contours/contour_stack.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace brachy {
namespace {

constexpr double kLeastDoubleArea = 1e-9;  // mm²

/// Twice the area, along the normal (Newell).
Vec3 area_vector(const std::vector<Vec3>& contour) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i + 1 < contour.size(); ++i)
    sum += (contour[i] - contour[0]).cross(contour[i + 1] - contour[0]);
  return sum;
}

Mat3 axes_along(Vec3 normal) {
  normal.normalize();
  Eigen::Index largest = 0;
  normal.cwiseAbs().maxCoeff(&largest);
  if (normal[largest] < 0) normal = -normal;
  // Transverse contours keep x and y.
  const Vec3 u = (largest == 0 ? Vec3::UnitY() : Vec3::UnitX()).eval();
  Mat3 axes;
  axes.col(2) = normal;
  axes.col(0) = (u - u.dot(normal) * normal).normalized();
  axes.col(1) = normal.cross(axes.col(0));
  return axes;
}

/// A contour in its plane.
struct FlatContour {
  double height_mm;
  Polygon polygon;
};

FlatContour flatten(const std::vector<Vec3>& contour, const Mat3& axes, const std::string& name,
                    std::size_t number) {
  FlatContour flat{0, {}};
  double least = 1e300, most = -1e300;
  for (const Vec3& p : contour) {
    const Vec3 local = axes.transpose() * p;
    least = std::min(least, local.z());
    most = std::max(most, local.z());
    flat.height_mm += local.z() / static_cast<double>(contour.size());
    if (flat.polygon.empty() || (flat.polygon.back() - local.head<2>()).norm() > 1e-6)
      flat.polygon.emplace_back(local.head<2>());
  }
  while (flat.polygon.size() > 1 && (flat.polygon.back() - flat.polygon.front()).norm() <= 1e-6)
    flat.polygon.pop_back();
  if (most - least > kOffPlaneMm)
    throw UserError(name + ": contour " + std::to_string(number) + " leaves the plane of the others by " +
                    text_of(most - least) + " mm; draw the contours of a structure in parallel planes");
  return flat;
}

bool is_same(const Polygon& a, const Polygon& b) {
  return a.size() == b.size() &&
         std::ranges::equal(a, b, [](const Vec2& p, const Vec2& q) { return (p - q).norm() < 1e-4; });
}

// A channel is drawn there and back along the same points.
Polygon without_spikes(Polygon polygon) {
  for (bool changed = true; changed && polygon.size() >= 3;) {
    changed = false;
    for (std::size_t i = 0; i < polygon.size() && polygon.size() >= 3; ++i) {
      const std::size_t before = (i + polygon.size() - 1) % polygon.size(), after = (i + 1) % polygon.size();
      if ((polygon[before] - polygon[after]).norm() > 1e-4) continue;
      // There and back to the same point: the spike's tip and one of its two ends go.
      polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(std::max(i, after)));
      polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(std::min(i, after)));
      changed = true;
    }
  }
  return polygon;
}

/// Cuts a polygon at an edge that it passes in both directions, a channel, into the polygons on either side.
void add_without_channels(Polygon polygon, std::vector<Polygon>& out) {
  polygon = without_spikes(std::move(polygon));
  const std::size_t n = polygon.size();
  if (n < 3) return;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 2; j < n; ++j) {
      const bool is_reverse = (polygon[i] - polygon[(j + 1) % n]).norm() < 1e-4 &&
                              (polygon[(i + 1) % n] - polygon[j]).norm() < 1e-4;
      if (!is_reverse) continue;
      const auto at = [&](std::size_t k) { return polygon.begin() + static_cast<std::ptrdiff_t>(k); };
      Polygon inner(at(i + 1), at(j));
      Polygon outer(at(0), at(i));
      outer.insert(outer.end(), at(j + 1), polygon.end());
      add_without_channels(std::move(inner), out);
      add_without_channels(std::move(outer), out);
      return;
    }
  out.push_back(std::move(polygon));
}

double side_of(const Vec2& a, const Vec2& b, const Vec2& p) {
  return (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
}

/// Whether two edges cross within both; not where they only touch.
bool do_cross(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  return side_of(a, b, c) * side_of(a, b, d) < 0 && side_of(c, d, a) * side_of(c, d, b) < 0;
}

bool do_cross(const Polygon& p, const Polygon& q) {
  Eigen::AlignedBox2d of_q;
  for (const Vec2& v : q) of_q.extend(v);
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec2 &a = p[i], &b = p[(i + 1) % p.size()];
    if (!of_q.intersects(Eigen::AlignedBox2d(a.cwiseMin(b), a.cwiseMax(b)))) continue;
    for (std::size_t j = 0; j < q.size(); ++j)
      if (do_cross(a, b, q[j], q[(j + 1) % q.size()])) return true;
  }
  return false;
}

bool has_crossing(const ContourPlane& plane) {
  for (std::size_t n = 0; n < plane.polygons.size(); ++n)
    for (std::size_t m = n + 1; m < plane.polygons.size(); ++m)
      if (do_cross(plane.polygons[n], plane.polygons[m])) return true;
  return false;
}

void measure_spacing(ContourStack& stack) {
  std::vector<double> gaps;
  for (std::size_t p = 0; p + 1 < stack.planes.size(); ++p)
    gaps.push_back(stack.planes[p + 1].height_mm - stack.planes[p].height_mm);
  if (gaps.empty()) return;
  std::vector<double> sorted = gaps;
  std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2));
  stack.spacing_mm = sorted[sorted.size() / 2];
  for (std::size_t p = 0; p < gaps.size(); ++p)
    if (gaps[p] > 1.5 * stack.spacing_mm && !stack.is_piece_end(p))
      stack.missing_planes += static_cast<std::size_t>(std::lround(gaps[p] / stack.spacing_mm)) - 1;
}

}  // namespace

double ContourStack::gap_mm(std::size_t plane) const {
  if (plane + 1 >= planes.size()) return std::numeric_limits<double>::infinity();
  return planes[plane + 1].height_mm - planes[plane].height_mm;
}

bool ContourStack::is_piece_end(std::size_t plane) const {
  if (plane + 1 >= planes.size()) return true;
  // Planes are drawn farther apart where a structure changes little.
  double usual = spacing_mm;
  if (plane > 0) usual = std::max(usual, gap_mm(plane - 1));
  if (plane + 2 < planes.size()) usual = std::max(usual, gap_mm(plane + 1));
  return gap_mm(plane) > kBridgedGap * usual;
}

bool has_area(std::span<const std::vector<Vec3>> contours) {
  // A point that is not finite is for stack_contours to refuse.
  return std::ranges::any_of(contours,
                             [](const auto& c) { return !(area_vector(c).norm() <= kLeastDoubleArea); });
}

ContourStack stack_contours(std::span<const std::vector<Vec3>> contours, const std::string& name) {
  Vec3 largest = Vec3::Zero();
  for (const auto& contour : contours) {
    if (contour.size() > kMostContourPoints)
      throw UserError(name + ": a contour has " + std::to_string(contour.size()) +
                      " points, and 50,000 are read; export it with fewer");
    for (const Vec3& p : contour)
      if (!(p.cwiseAbs().maxCoeff() <= kMostMm))
        throw UserError(
            name + ": a contour has a point that is not finite or farther than 100 m away; export it again");
    const Vec3 area = area_vector(contour);
    if (area.norm() > largest.norm()) largest = area;
  }
  if (!(largest.norm() > kLeastDoubleArea))
    throw UserError(name + ": has no closed contour with an area; export it as CLOSED_PLANAR contours");
  ContourStack stack;
  stack.axes = axes_along(largest);
  std::vector<FlatContour> all;
  for (std::size_t c = 0; c < contours.size(); ++c)
    if (contours[c].size() >= 3) all.push_back(flatten(contours[c], stack.axes, name, c + 1));
  std::ranges::stable_sort(all, {}, &FlatContour::height_mm);
  for (FlatContour& contour : all) {
    if (contour.polygon.size() < 3) continue;
    if (stack.planes.empty() || contour.height_mm - stack.planes.back().height_mm > kSamePlaneMm)
      stack.planes.push_back({contour.height_mm, {}});
    auto& polygons = stack.planes.back().polygons;
    if (std::ranges::any_of(polygons, [&](const Polygon& p) { return is_same(p, contour.polygon); }))
      ++stack.repeated;
    else
      polygons.push_back(std::move(contour.polygon));
  }
  for (ContourPlane& plane : stack.planes) {
    std::vector<Polygon> polygons;
    for (Polygon& polygon : plane.polygons) add_without_channels(std::move(polygon), polygons);
    plane.polygons = std::move(polygons);
  }
  std::erase_if(stack.planes, [](const ContourPlane& plane) { return plane.polygons.empty(); });
  if (stack.planes.empty()) throw UserError(name + ": has no contour with an area; export it again");
  stack.crossing_planes = static_cast<std::size_t>(std::ranges::count_if(stack.planes, has_crossing));
  measure_spacing(stack);
  return stack;
}

}  // namespace brachy
