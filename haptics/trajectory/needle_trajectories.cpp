#include "haptics/trajectory/needle_trajectories.h"

#include <algorithm>
#include <cassert>

namespace brachy {
namespace {

template <class F>
NeedleTrajectories each(const std::vector<NeedleTrajectories::Needle>& needles, F&& change) {
  std::vector<NeedleTrajectories::Needle> changed;
  changed.reserve(needles.size());
  for (const auto& needle : needles) changed.push_back({needle.id, change(needle.motion)});
  return NeedleTrajectories(std::move(changed));
}

Trajectory shifted(const Trajectory& motion, const Vec3& shift) {
  std::vector<TrajectorySample> samples = motion.samples();
  for (TrajectorySample& sample : samples) sample.X_WN.p += shift;
  return Trajectory(std::move(samples));
}

}  // namespace

NeedleTrajectories::NeedleTrajectories(std::vector<Needle> needles) : needles_(std::move(needles)) {
  assert(!needles_.empty());
  assert(std::ranges::adjacent_find(needles_, [](const auto& a, const auto& b) { return a.id >= b.id; }) ==
         needles_.end());
  start_s_ = needles_.front().motion.start_s();
  end_s_ = needles_.front().motion.end_s();
  for (const Needle& needle : needles_) {
    start_s_ = std::min(start_s_, needle.motion.start_s());
    end_s_ = std::max(end_s_, needle.motion.end_s());
  }
}

std::optional<RigidTransform> NeedleTrajectories::sample(std::uint32_t id, double t_s) const {
  const Trajectory* motion = find(id);
  if (!motion || t_s < motion->start_s() - kSameTime) return std::nullopt;
  return motion->sample(t_s);
}

bool NeedleTrajectories::button(std::uint32_t id, double t_s) const {
  const Trajectory* motion = find(id);
  return motion && motion->button(t_s);
}

bool NeedleTrajectories::button(std::uint32_t id, double after_s, double until_s) const {
  const Trajectory* motion = find(id);
  return motion && motion->button(after_s, until_s);
}

const Trajectory* NeedleTrajectories::find(std::uint32_t id) const {
  const auto needle = std::ranges::lower_bound(needles_, id, {}, &Needle::id);
  return needle == needles_.end() || needle->id != id ? nullptr : &needle->motion;
}

NeedleTrajectories NeedleTrajectories::transformed(const RigidTransform& X_VW) const {
  return each(needles_, [&](const Trajectory& motion) { return motion.transformed(X_VW); });
}

NeedleTrajectories NeedleTrajectories::centred_on(const Vec3& p_W) const {
  Vec3 mean = Vec3::Zero();
  for (const Needle& needle : needles_) mean += needle.motion.dwelling_point();
  mean /= static_cast<double>(needles_.size());
  return each(needles_, [&](const Trajectory& motion) { return shifted(motion, p_W - mean); });
}

NeedleTrajectories NeedleTrajectories::retimed(const std::function<double(double)>& time_of) const {
  return each(needles_, [&](const Trajectory& motion) {
    std::vector<TrajectorySample> samples = motion.samples();
    for (TrajectorySample& sample : samples) sample.t_s = time_of(sample.t_s);
    return Trajectory(std::move(samples));
  });
}

NeedleTrajectories NeedleTrajectories::sped_up(double factor) const {
  assert(factor > 0);
  return retimed([&](double t_s) { return t_s / factor; });
}

std::vector<std::string> doubts_about(const NeedleTrajectories& trajectories) {
  // A needle in a prostate goes tens of mm, at 0.1 mm/s at least; the clinic's insertions take minutes.
  constexpr double kLeastReachMm = 1, kLeastSpeedMmS = 0.01, kLongestInsertionS = 600;
  std::vector<std::string> doubts;
  std::size_t samples = 0;
  double path_mm = 0, reach_mm = 0;
  for (const NeedleTrajectories::Needle& needle : trajectories.needles()) {
    const auto& own = needle.motion.samples();
    samples += own.size();
    for (std::size_t i = 0; i < own.size(); ++i) {
      reach_mm = std::max(reach_mm, own[i].X_WN.p.cwiseAbs().maxCoeff());
      if (i > 0) path_mm += (own[i].X_WN.p - own[i - 1].X_WN.p).norm();
    }
  }
  if (samples == 1)
    doubts.emplace_back("has a single row: the needle stands where it is; add rows for a motion");
  if (samples > 1 && path_mm > 0 && reach_mm < kLeastReachMm)
    doubts.emplace_back("no tip is 1 mm from the origin: are positions in metres? m03, m13, m23 are in mm");
  const double duration_s = trajectories.duration_s();
  if (path_mm > 0 && duration_s > kLongestInsertionS && path_mm < kLeastSpeedMmS * duration_s)
    doubts.emplace_back("the needle moves by less than 0.01 mm/s: are times in milliseconds? t_s is in s");
  return doubts;
}

}  // namespace brachy
