#include "core/brachytherapy/contours/contour_score.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/surface/surface_volume.h"

namespace brachy {
namespace {

constexpr double kPointEveryMm = 0.05;

double mean_distance(const std::vector<OutlineDistance>& distances) {
  double sum = 0, length = 0;
  for (const OutlineDistance& d : distances) {
    sum += d.weight_mm * d.distance_mm;
    length += d.weight_mm;
  }
  return length > 0 ? sum / length : 0;
}

/// Distances both ways.
struct TwoWays {
  std::vector<OutlineDistance> there, back;

  void add(std::span<const PlaneEdge> outlined, std::span<const PlaneEdge> truth) {
    add_outline_distances(outlined, truth, kPointEveryMm, there);
    add_outline_distances(truth, outlined, kPointEveryMm, back);
  }
  void add(const TwoWays& others) {
    there.insert(there.end(), others.there.begin(), others.there.end());
    back.insert(back.end(), others.back.begin(), others.back.end());
  }
  double quantile(double share) {
    return std::max(distance_quantile(there, share), distance_quantile(back, share));
  }
  double mean() const { return 0.5 * (mean_distance(there) + mean_distance(back)); }
};

// Whole steps from the first plane between which the gland, or an outline, is.
std::pair<long, long> planes_of(const ContourSet& set, const SurfaceMesh& gland) {
  if (!(set.step_mm > 0)) return {0, 0};
  const RigidTransform X_SW = set.X_WS.inverse();
  double low = 0, high = set.contours.back().offset_mm;
  for (const Vec3& v : gland.vertices) {
    const double z = (X_SW * v).z();
    low = std::min(low, z);
    high = std::max(high, z);
  }
  return {std::lround(std::ceil(low / set.step_mm - 1e-9)),
          std::lround(std::floor(high / set.step_mm + 1e-9))};
}

// The contour whose plane is nearest.
std::size_t nearest_contour(const ContourSet& set, double offset_mm) {
  const auto nearest = std::ranges::min_element(
      set.contours, {}, [&](const Contour& contour) { return std::abs(contour.offset_mm - offset_mm); });
  return static_cast<std::size_t>(nearest - set.contours.begin());
}

}  // namespace

ContourStudy make_study(const ContourSet& set, std::span<const SurfaceMesh* const> glands) {
  ContourStudy study{set.X_WS, set.step_mm, 0, {}};
  const auto shape_of = [&](std::size_t contour) { return glands.size() > 1 ? contour : 0; };
  std::pair<long, long> range{0, 0};
  for (const SurfaceMesh* gland : glands) {
    study.gland_cm3 += 1e-3 * enclosed_mm3(*gland) / static_cast<double>(glands.size());
    const auto [first, last] = planes_of(set, *gland);
    range = {std::min(range.first, first), std::max(range.second, last)};
  }
  auto contour = set.contours.begin();
  for (long k = range.first; k <= range.second; ++k) {
    const bool is_drawn = contour != set.contours.end() &&
                          (set.step_mm == 0 || std::lround(contour->offset_mm / set.step_mm) == k);
    StudyPlane plane;
    plane.offset_mm = is_drawn ? contour->offset_mm : static_cast<double>(k) * set.step_mm;
    plane.shape = shape_of(is_drawn ? static_cast<std::size_t>(contour - set.contours.begin())
                                    : nearest_contour(set, plane.offset_mm));
    RigidTransform X_WP = set.X_WS;
    X_WP.p += plane.offset_mm * X_WP.R.col(2);
    plane.truth = plane_section(*glands[plane.shape], X_WP);
    if (is_drawn) {
      plane.slice = contour->slice;
      plane.outlined = (contour++)->edges();
    }
    if (!plane.outlined.empty() || !plane.truth.empty()) study.planes.push_back(std::move(plane));
  }
  return study;
}

ContourScore score_study(const ContourStudy& study) {
  ContourScore score;
  score.step_mm = study.step_mm;
  score.gland_cm3 = study.gland_cm3;
  TwoWays all;
  double outlined = 0, truth = 0, both = 0;
  for (const StudyPlane& plane : study.planes) {
    SliceScore slice;
    slice.slice = plane.slice;
    slice.offset_mm = plane.offset_mm;
    slice.areas = region_areas(plane.outlined, plane.truth);
    TwoWays distances;
    distances.add(plane.outlined, plane.truth);
    slice.hausdorff_mm = distances.quantile(1);
    slice.mean_mm = distances.mean();
    all.add(distances);
    outlined += slice.areas.first;
    truth += slice.areas.second;
    both += slice.areas.both;
    score.missed += slice.is_missed();
    score.beyond += slice.is_beyond();
    score.slices.push_back(slice);
  }
  score.dice = 2 * both / (outlined + truth);
  score.outlined_cm3 = 1e-3 * outlined * study.step_mm;
  score.same_planes_cm3 = 1e-3 * truth * study.step_mm;
  score.hausdorff_mm = all.quantile(1);
  score.hausdorff_95_mm = all.quantile(0.95);
  score.mean_mm = all.mean();
  return score;
}

ContourScore score_contours(const ContourSet& set, const SurfaceMesh& gland) {
  const SurfaceMesh* const one = &gland;
  return score_study(make_study(set, {&one, 1}));
}

}  // namespace brachy
