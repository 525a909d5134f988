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

}  // namespace

ContourScore score_contours(const ContourSet& set, const SurfaceMesh& gland) {
  ContourScore score;
  score.step_mm = set.step_mm;
  score.gland_cm3 = 1e-3 * enclosed_mm3(gland);
  TwoWays all;
  double outlined = 0, truth = 0, both = 0;
  const auto [first, last] = planes_of(set, gland);
  auto contour = set.contours.begin();
  for (long k = first; k <= last; ++k) {
    const bool is_drawn = contour != set.contours.end() &&
                          (set.step_mm == 0 || std::lround(contour->offset_mm / set.step_mm) == k);
    SliceScore slice;
    slice.offset_mm = is_drawn ? contour->offset_mm : static_cast<double>(k) * set.step_mm;
    RigidTransform X_WP = set.X_WS;
    X_WP.p += slice.offset_mm * X_WP.R.col(2);
    const std::vector<PlaneEdge> section = plane_section(gland, X_WP);
    const std::vector<PlaneEdge> drawn = is_drawn ? contour->edges() : std::vector<PlaneEdge>{};
    if (is_drawn) slice.slice = (contour++)->slice;
    if (drawn.empty() && section.empty()) continue;
    slice.areas = region_areas(drawn, section);
    TwoWays distances;
    distances.add(drawn, section);
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
  score.outlined_cm3 = 1e-3 * outlined * set.step_mm;
  score.same_planes_cm3 = 1e-3 * truth * set.step_mm;
  score.hausdorff_mm = all.quantile(1);
  score.hausdorff_95_mm = all.quantile(0.95);
  score.mean_mm = all.mean();
  return score;
}

}  // namespace brachy
