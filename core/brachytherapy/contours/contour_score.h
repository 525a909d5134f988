#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/brachytherapy/contours/contour_file.h"
#include "core/brachytherapy/contours/plane_region.h"
#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// One plane of a volume study.
struct SliceScore {
  std::optional<long long>
      slice;             ///< its number in the file; none: the gland is there, and nobody outlined it
  double offset_mm = 0;  ///< from the first outlined plane along the slices' normal
  RegionAreas areas;     ///< first: outlined, second: true
  double hausdorff_mm = 0, mean_mm = 0;  ///< between the outlines; 0 where one is empty

  bool is_missed() const { return !slice; }
  bool is_beyond() const { return slice && !(areas.second > 0); }
  double dice() const { return 2 * areas.both / (areas.first + areas.second); }
};

/// How well outlines meet a gland.
struct ContourScore {
  std::vector<SliceScore> slices;  ///< ascending, a step apart; all planes that the gland or an outline is in
  double step_mm = 0;
  /// 2 |A ∩ B| / (|A| + |B|) over all planes, those missed and those beyond the gland's ends too (L. R. Dice, Ecology
  /// 26, 1945).
  double dice = 0;
  double outlined_cm3 =
      0;  ///< by planimetry: areas times the step, as a volume study does. 0 of a single slice
  double same_planes_cm3 = 0;  ///< the gland by planimetry in all planes
  double gland_cm3 = 0;        ///< the gland, exactly
  /// Between outlines in the planes that have both, each way: the largest; the larger way's 95th percentile of length;
  /// the mean (D. P. Huttenlocher et al., IEEE PAMI 15, 1993).
  double hausdorff_mm = 0, hausdorff_95_mm = 0, mean_mm = 0;
  std::size_t missed = 0, beyond = 0;  ///< planes

  double volume_error_percent() const { return 100 * (outlined_cm3 / gland_cm3 - 1); }
};

/// One plane of a volume study, with both outlines in S (ContourSet).
struct StudyPlane {
  std::optional<long long> slice;  ///< none: missed
  std::size_t shape = 0;  ///< of the glands given: the plane's own, or that of the nearest outlined one
  double offset_mm = 0;
  std::vector<PlaneEdge> outlined, truth;
};

/// A volume study with the truth, which can be stored and scored again.
struct ContourStudy {
  RigidTransform X_WS;
  double step_mm = 0;
  double gland_cm3 = 0;            ///< the mean of the glands given
  std::vector<StudyPlane> planes;  ///< as ContourScore::slices
};

/// The planes of a study in which the gland or an outline is. `glands`: the gland's surface as it was when each contour
/// was drawn, in the order of `contours` (or one for all); closed, outward, W, mm. Not real-time.
ContourStudy make_study(const ContourSet& contours, std::span<const SurfaceMesh* const> glands);
ContourScore score_study(const ContourStudy& study);

/// Scores outlines against the gland's surface (closed, outward, W, mm) in their planes and, where there is a step, in
/// those a step apart in which the gland is cut besides. Distances are of points every 0.05 mm of the outlines.
/// Not real-time.
ContourScore score_contours(const ContourSet& contours, const SurfaceMesh& gland);

}  // namespace brachy
