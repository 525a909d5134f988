#include "haptics/trajectory/needle_metrics.h"

#include <algorithm>
#include <cmath>

namespace brachy {
namespace {

/// Perk Tutor's tissue puncture: from outside to inside over 1 mm either way along the needle.
class PassCounter {
 public:
  explicit PassCounter(const InsideTest& inside) : inside_(inside) {}

  /// True where this pose is the first one inside.
  bool enters(const RigidTransform& X_WN, bool tip_inside) {
    constexpr double kReachMm = 1;
    const Vec3 reach = kReachMm * X_WN.R.col(2);
    if (tip_inside == punctured_) return false;
    if (inside_(X_WN.p + reach) != tip_inside || inside_(X_WN.p - reach) != tip_inside) return false;
    punctured_ = tip_inside;
    return punctured_;
  }

 private:
  const InsideTest& inside_;
  bool punctured_ = false;
};

double tip_way(const TrajectorySample& a, const TrajectorySample& b) {
  return (b.X_WN.p - a.X_WN.p).norm();
}

/// `share` of the way through the ranks of sorted values.
double percentile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return NeedleMetrics::kNone;
  const double rank = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(rank), above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (rank - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

}  // namespace

std::vector<TissueVisit> tissue_visits(std::span<const TrajectorySample> motion, const InsideTest& inside) {
  std::vector<TissueVisit> visits;
  PassCounter passes(inside);
  bool was_inside = false;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const bool is_inside = inside(motion[i].X_WN.p), enters = passes.enters(motion[i].X_WN, is_inside);
    if (is_inside) {
      if (!was_inside) visits.push_back({i, i, false, 0, 0});
      TissueVisit& visit = visits.back();
      visit.end = i + 1;
      visit.entry |= enters;
      if (i > 0) {
        visit.path_mm += tip_way(motion[i - 1], motion[i]);
        visit.time_s += motion[i].t_s - motion[i - 1].t_s;
      }
    }
    was_inside = is_inside;
  }
  return visits;
}

void NeedleMetricsTally::add(std::span<const TrajectorySample> motion, std::span<const TissueVisit> visits) {
  if (motion.empty()) return;
  first_s_ = sums_.poses == 0 ? motion.front().t_s : std::min(first_s_, motion.front().t_s);
  last_s_ = sums_.poses == 0 ? motion.back().t_s : std::max(last_s_, motion.back().t_s);
  sums_.poses += motion.size();
  double left_s = motion.front().t_s;  // when the tip came to where it is
  for (std::size_t i = 1; i < motion.size(); ++i) {
    const double way_mm = tip_way(motion[i - 1], motion[i]);
    sums_.path_length_mm += way_mm;
    if (way_mm == 0) continue;
    const bool was_resting = motion[i - 1].t_s - left_s > NeedleMetrics::kHeldS;
    speeds_.push_back(way_mm / (motion[i].t_s - (was_resting ? motion[i - 1].t_s : left_s)));
    left_s = motion[i].t_s;
  }
  for (const TissueVisit& visit : visits) {
    sums_.path_in_tissue_mm += visit.path_mm;
    sums_.time_in_tissue_s += visit.time_s;
    sums_.passes += visit.entry;
  }
}

NeedleMetrics NeedleMetricsTally::result() const {
  std::vector<double> sorted = speeds_;
  std::ranges::sort(sorted);
  NeedleMetrics metrics = sums_;
  metrics.elapsed_time_s = last_s_ - first_s_;
  metrics.speed_p50_mm_s = percentile(sorted, 0.5);
  metrics.speed_p90_mm_s = percentile(sorted, 0.9);
  metrics.speed_p95_mm_s = percentile(sorted, 0.95);
  metrics.speed_max_mm_s = percentile(sorted, 1);
  return metrics;
}

}  // namespace brachy
