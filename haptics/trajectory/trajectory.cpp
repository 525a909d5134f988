#include "haptics/trajectory/trajectory.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "haptics/trajectory/rigid_pose.h"

namespace brachy {

namespace {

/// The first sample that is not yet there at t_s.
auto first_after(const std::vector<TrajectorySample>& samples, double t_s) {
  return std::upper_bound(samples.begin(), samples.end(), t_s,
                          [](double t, const TrajectorySample& s) { return t < s.t_s - kSameTime; });
}

}  // namespace

Trajectory::Trajectory(std::vector<TrajectorySample> samples) : samples_(std::move(samples)) {
  assert(!samples_.empty());
  assert(std::adjacent_find(samples_.begin(), samples_.end(),
                            [](const auto& a, const auto& b) { return !(a.t_s < b.t_s); }) == samples_.end());
}

RigidTransform Trajectory::sample(double t_s) const {
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), t_s,
                                      [](const TrajectorySample& s, double t) { return s.t_s < t; });
  if (after == samples_.end()) return samples_.back().X_WN;
  if (after == samples_.begin()) return samples_.front().X_WN;
  const TrajectorySample& a = *(after - 1);
  const TrajectorySample& b = *after;
  const double since_a = t_s - a.t_s;
  const double until_b = b.t_s - t_s;
  if (std::min(since_a, until_b) <= kSameTime) return since_a < until_b ? a.X_WN : b.X_WN;
  // Of a needle at rest a file may have the ends alone.
  if (a.X_WN.R == b.X_WN.R && a.X_WN.p == b.X_WN.p) return a.X_WN;
  return interpolate(a.X_WN, b.X_WN, since_a / (b.t_s - a.t_s));
}

bool Trajectory::button(double t_s) const {
  const auto after = first_after(samples_, t_s);
  return after != samples_.begin() && (after - 1)->button;
}

bool Trajectory::button(double after_s, double until_s) const {
  const auto end = first_after(samples_, until_s);
  const auto pressed = [](const TrajectorySample& s) { return s.button; };
  return button(until_s) || std::any_of(std::min(first_after(samples_, after_s), end), end, pressed);
}

double Trajectory::tip_path_mm() const {
  double length = 0;
  for (std::size_t i = 1; i < samples_.size(); ++i) {
    length += (samples_[i].X_WN.p - samples_[i - 1].X_WN.p).norm();
  }
  return length;
}

Trajectory Trajectory::transformed(const RigidTransform& X_VW) const {
  std::vector<TrajectorySample> moved = samples_;
  for (TrajectorySample& s : moved) {
    s.X_WN = X_VW * s.X_WN;
    make_rigid(s.X_WN);  // two small errors may add up to more than a file is allowed to keep
  }
  return Trajectory(std::move(moved));
}

Vec3 Trajectory::dwelling_point() const {
  // Each sample stands for half the time to its neighbours; the median is where half of the time is used up.
  const std::size_t n = samples_.size();
  std::vector<std::pair<double, double>> places(n);  // coordinate, weight
  Vec3 median;
  for (int axis = 0; axis < 3; ++axis) {
    double total = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double before = samples_[i == 0 ? 0 : i - 1].t_s, after = samples_[i + 1 == n ? i : i + 1].t_s;
      const double weight = n == 1 ? 1 : 0.5 * (after - before);
      places[i] = {samples_[i].X_WN.p[axis], weight};
      total += weight;
    }
    std::sort(places.begin(), places.end());
    double used = 0;
    for (const auto& [coordinate, weight] : places) {
      used += weight;
      median[axis] = coordinate;
      if (used >= 0.5 * total) break;
    }
  }
  return median;
}

Trajectory Trajectory::centred_on(const Vec3& p_W) const {
  const Vec3 shift = p_W - dwelling_point();
  std::vector<TrajectorySample> moved = samples_;
  for (TrajectorySample& s : moved) s.X_WN.p += shift;
  return Trajectory(std::move(moved));
}

}  // namespace brachy
