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

NeedleTrajectories NeedleTrajectories::sped_up(double factor) const {
  assert(factor > 0);
  return each(needles_, [&](const Trajectory& motion) {
    std::vector<TrajectorySample> samples = motion.samples();
    for (TrajectorySample& sample : samples) sample.t_s /= factor;
    return Trajectory(std::move(samples));
  });
}

}  // namespace brachy
