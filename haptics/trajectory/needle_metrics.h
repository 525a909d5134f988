#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "haptics/trajectory/trajectory.h"

namespace brachy {

/// Whether a point (mm, world) is in the tissue; SurfaceBvh::inside of its surface at rest.
using InsideTest = std::function<bool(const Vec3&)>;

/// An interval of a needle's motion with its tip in the tissue.
struct TissueVisit {
  std::size_t first = 0, end = 0;  ///< samples first … end − 1 have the tip inside, those beside them not
  bool entry = false;              ///< counts as a pass: see NeedleMetrics::passes
  double path_mm = 0;              ///< of the segments that end in it
  double time_s = 0;
};

/// The visits of a motion in order. A segment counts when its end is inside: the one that brings the tip in
/// does, the one that takes it out does not.
std::vector<TissueVisit> tissue_visits(std::span<const TrajectorySample> motion, const InsideTest& inside);

/// The needle-based metrics of Perk Tutor (Ungi et al., IEEE TBME 2012; definitions as in
/// PerkTutor/PythonMetrics, ElapsedTime, PathLength, TissuePath, TissueTime and TissuePunctures), of one
/// needle or several together.
struct NeedleMetrics {
  /// no segment to compute it from
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  /// Equal samples for longer than this are a rest: of a device of 10 Hz and more none are.
  static constexpr double kHeldS = 0.1;

  std::size_t poses = 0;
  double elapsed_time_s = 0;  ///< first pose to last; of several needles the first of any to the last of any
  double path_length_mm = 0;  ///< polyline of tip positions; of several needles the sum, as below
  double path_in_tissue_mm = 0;
  double time_in_tissue_s = 0;
  /// How often the tip and the points 1 mm before and behind it along the needle entered, all three having
  /// been outside before: a tip that trembles on the surface is one pass. A motion that begins inside begins
  /// with one.
  std::uint32_t passes = 0;
  /// Quantiles of the tip's speed over each segment in which it moves, mm/s, every segment weighted equally; linear in
  /// rank between two of them (Hyndman, Fan 1996, type 7, as numpy.percentile). A hand that rests has no speed; a
  /// device that is slower than the samples leaves equal ones between two places: up to kHeldS they belong to the
  /// segment that follows.
  double speed_p50_mm_s = kNone, speed_p90_mm_s = kNone, speed_p95_mm_s = kNone, speed_max_mm_s = kNone;
};

/// Adds needles' motions up to metrics.
class NeedleMetricsTally {
 public:
  /// A needle's samples in order, none being allowed, and its visits to the tissue.
  void add(std::span<const TrajectorySample> motion, std::span<const TissueVisit> visits);
  NeedleMetrics result() const;

 private:
  NeedleMetrics sums_;
  double first_s_ = 0, last_s_ = 0;
  std::vector<double> speeds_;  // mm/s
};

}  // namespace brachy
