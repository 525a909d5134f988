#include "core/geometry/contours/contour_stack.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>

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
  Eigen::AlignedBox2d box;
};

/// Whether two outlines are nearly the same, as neighbouring planes have them; those that are the same are one contour
/// drawn twice, and farther apart are a wall's.
bool are_alike(const Eigen::AlignedBox2d& a, const Eigen::AlignedBox2d& b) {
  constexpr double kWallMm = 1;
  const double apart =
      std::max((a.min() - b.min()).cwiseAbs().maxCoeff(), (a.max() - b.max()).cwiseAbs().maxCoeff());
  return apart > kRepeatedMm && apart < kWallMm;
}

FlatContour flatten(const std::vector<Vec3>& contour, const Mat3& axes, const std::string& name,
                    std::size_t number) {
  FlatContour flat{0, {}, {}};
  double least = 1e300, most = -1e300;
  for (const Vec3& p : contour) {
    const Vec3 local = axes.transpose() * p;
    least = std::min(least, local.z());
    most = std::max(most, local.z());
    flat.height_mm += local.z() / static_cast<double>(contour.size());
    flat.polygon.emplace_back(local.head<2>());
    flat.box.extend(Vec2(local.head<2>()));
  }
  if (most - least > kOffPlaneMm)
    throw UserError(name + ": contour " + std::to_string(number) + " leaves the plane of the others by " +
                    text_of(most - least) + " mm; draw the contours of a structure in parallel planes");
  return flat;
}

/// The mean of the contours' directions that lie within 2° of the largest one's, by area.
Vec3 common_normal(std::span<const std::vector<Vec3>> contours, const Vec3& largest) {
  Vec3 sum = Vec3::Zero();
  for (const auto& contour : contours) {
    const Vec3 area = area_vector(contour);
    if (std::abs(area.dot(largest)) > std::cos(0.035) * area.norm() * largest.norm())
      sum += area.dot(largest) > 0 ? area : Vec3(-area);
  }
  return sum;
}

/// The gap at which half of the length is drawn: jitter has short gaps, however many, and pieces that lie apart a few
/// long ones.
double usual_gap(const std::vector<double>& heights) {
  constexpr double kLongestMm = 10, kNothingMm = 1e-6;
  std::vector<double> gaps;
  for (std::size_t n = 1; n < heights.size(); ++n)
    if (const double gap = heights[n] - heights[n - 1]; gap > kNothingMm) gaps.push_back(gap);
  std::ranges::sort(gaps);
  double total = 0, sum = 0;
  for (const double gap : gaps) total += std::min(gap, kLongestMm);
  for (const double gap : gaps)
    if ((sum += std::min(gap, kLongestMm)) >= 0.5 * total) return gap;
  return 0;
}

/// Each plane takes what lies within `most_mm` of its lowest contour.
std::vector<std::size_t> grouped(const std::vector<double>& heights, double most_mm) {
  std::vector<std::size_t> planes;
  double from = 0;
  for (const double height : heights) {
    if (planes.empty() || height - from > most_mm) {
      planes.push_back(planes.empty() ? 0 : planes.back() + 1);
      from = height;
    } else {
      planes.push_back(planes.back());
    }
  }
  return planes;
}

std::vector<double> means_of(const std::vector<double>& heights, const std::vector<std::size_t>& planes) {
  std::vector<double> sums(planes.back() + 1, 0), counts(planes.back() + 1, 0);
  for (std::size_t n = 0; n < heights.size(); ++n) {
    sums[planes[n]] += heights[n];
    ++counts[planes[n]];
  }
  for (std::size_t p = 0; p < sums.size(); ++p) sums[p] /= counts[p];
  return sums;
}

/// Where planes lie at whole multiples of a distance, each near its own: the line through them by number, of least
/// squares.
std::optional<std::vector<double>> even_heights(const std::vector<double>& means) {
  constexpr double kOffShare = 0.15;
  const double usual = usual_gap(means);
  std::vector<double> numbers = {0};
  for (std::size_t p = 1; p < means.size(); ++p) {
    const double steps = std::round((means[p] - means[p - 1]) / usual);
    if (steps < 1) return std::nullopt;
    numbers.push_back(numbers.back() + steps);
  }
  if (means.size() < 3) return means;
  const auto n = static_cast<Eigen::Index>(means.size());
  const Eigen::Map<const Eigen::ArrayXd> at(numbers.data(), n), height(means.data(), n);
  const Eigen::ArrayXd from_middle = at - at.mean();
  const double step = (from_middle * (height - height.mean())).sum() / from_middle.square().sum();
  const Eigen::ArrayXd even = height.mean() + step * from_middle;
  if (!((height - even).abs().maxCoeff() < kOffShare * step)) return std::nullopt;
  return std::vector<double>(even.begin(), even.end());
}

bool are_even(const std::vector<double>& means) {
  return even_heights(means).has_value();
}

/// Slices are evenly spaced: where contours scatter about such planes they are of these.
void move_to_slices(ContourStack& stack, double image_spacing_mm) {
  std::vector<double> heights;
  for (const ContourPlane& plane : stack.planes) heights.push_back(plane.height_mm);
  auto even = even_heights(heights);
  if (!even) return;
  // Of few planes the images tell the distance better.
  constexpr double kAlike = 0.05;
  const double middle = std::accumulate(even->begin(), even->end(), 0.0) / static_cast<double>(even->size());
  if (const double step = usual_gap(*even); std::abs(step - image_spacing_mm) < kAlike * image_spacing_mm)
    for (double& height : *even) height = middle + (height - middle) * image_spacing_mm / step;
  for (std::size_t p = 0; p < heights.size(); ++p) {
    stack.most_moved_mm = std::max(stack.most_moved_mm, std::abs((*even)[p] - heights[p]));
    stack.planes[p].height_mm = (*even)[p];
  }
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

std::vector<std::size_t> planes_of_heights(const std::vector<double>& heights, double image_spacing_mm,
                                           const std::function<bool(std::size_t, std::size_t)>& is_alike) {
  constexpr double kOfSpacing = 0.25, kLeastMm = 0.05, kMostUnevenMm = 0.1;
  // Slices of their own, however much finer than the images.
  std::vector<std::size_t> planes = grouped(heights, kLeastMm);
  constexpr std::size_t kLeastEven = 4;  // two contours of one slice say nothing
  if (planes.empty() || (planes.back() + 1 >= kLeastEven && are_even(means_of(heights, planes))))
    return planes;
  double spacing = usual_gap(heights);
  if (spacing < 0.2 * image_spacing_mm) spacing = image_spacing_mm;
  planes = grouped(heights, std::max(kLeastMm, kOfSpacing * spacing));
  bool is_sound = are_even(means_of(heights, planes));
  std::size_t first = 0;  // of the plane
  for (std::size_t n = 1; n < heights.size() && is_sound; ++n) {
    if (planes[n] != planes[first]) first = n;
    for (std::size_t m = first; heights[n] - heights[m] > kLeastMm && is_sound; ++m)
      is_sound = !is_alike(n, m);
  }
  if (is_sound) return planes;
  return grouped(heights, std::clamp(kOfSpacing * spacing, kLeastMm, kMostUnevenMm));
}

bool has_area(std::span<const std::vector<Vec3>> contours) {
  // A point that is not finite is for stack_contours to refuse.
  return std::ranges::any_of(contours,
                             [](const auto& c) { return !(area_vector(c).norm() <= kLeastDoubleArea); });
}

ContourStack stack_contours(std::span<const std::vector<Vec3>> contours, const std::string& name,
                            const ImageSlices& images) {
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
  stack.axes = axes_along(common_normal(contours, largest));
  std::vector<FlatContour> all;
  for (std::size_t c = 0; c < contours.size(); ++c)
    if (contours[c].size() >= 3) all.push_back(flatten(contours[c], stack.axes, name, c + 1));
  std::erase_if(all, [](const FlatContour& contour) { return contour.polygon.size() < 3; });
  std::ranges::stable_sort(all, {}, &FlatContour::height_mm);
  std::vector<double> heights;
  for (const FlatContour& contour : all) heights.push_back(contour.height_mm);
  const bool is_of_images = std::abs(images.normal.dot(stack.axes.col(2))) > 0.999;
  const std::vector<std::size_t> planes =
      planes_of_heights(heights, is_of_images ? images.spacing_mm : 0,
                        [&](std::size_t n, std::size_t m) { return are_alike(all[n].box, all[m].box); });
  std::size_t pairs = 0;
  for (std::size_t n = 0; n < all.size();) {
    std::vector<Polygon> polygons;
    double sum = 0;
    std::size_t end = n;
    for (; end < all.size() && planes[end] == planes[n]; ++end) {
      sum += all[end].height_mm;
      std::ranges::move(simple_loops(all[end].polygon), std::back_inserter(polygons));
    }
    stack.most_apart_mm = std::max(stack.most_apart_mm, all[end - 1].height_mm - all[n].height_mm);
    stack.repeated += drop_repeated(polygons);
    std::vector<PlaneShape> shapes = plane_shapes(std::move(polygons), name, pairs);
    if (std::ranges::any_of(shapes, [](const PlaneShape& s) { return s.polygons.size() > 1; }))
      ++stack.crossing_planes;
    if (!shapes.empty()) stack.planes.push_back({sum / static_cast<double>(end - n), std::move(shapes)});
    n = end;
  }
  if (stack.planes.empty()) throw UserError(name + ": has no contour with an area; export it again");
  move_to_slices(stack, is_of_images ? images.spacing_mm : 0);
  measure_spacing(stack);
  if (stack.planes.size() == 1 && is_of_images) stack.spacing_mm = images.spacing_mm;
  return stack;
}

}  // namespace brachy
