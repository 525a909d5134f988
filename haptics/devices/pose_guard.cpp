#include "haptics/devices/pose_guard.h"

#include <cassert>
#include <numeric>

#include "haptics/force/elapsed.h"
#include "haptics/trajectory/rigid_pose.h"

namespace brachy {

namespace {

constexpr std::int64_t kDriftDivisor = 5000;  // 200 ppm: twice what a bad quartz does

}  // namespace

std::string_view to_string(PoseStatus verdict) {
  switch (verdict) {
    case PoseStatus::kAccepted:
      return "pose accepted";
    case PoseStatus::kNotFinite:
      return "pose has NaN or infinity; send finite numbers, or nothing while tracking is lost";
    case PoseStatus::kNotRigid:
      return "pose is not rigid; send an orthonormal right-handed rotation, off by 1e-3 at most";
    case PoseStatus::kStale:
      return "pose is stale; send each pose when it is taken and drop those that wait";
    case PoseStatus::kOutOfOrder:
      return "pose goes back in time; let stamp and sequence increase with every pose";
    case PoseStatus::kOutOfRange:
      return "pose's tip is more than 10 m from the origin; send positions in mm";
    case PoseStatus::kNotAttached:
      return "pose from a device that does not hold the lease; ask for it first";
  }
  return "unknown verdict";
}

PoseStatus PoseGuard::check(NeedlePose& pose) {
  return note(judge(pose));
}

PoseStatus PoseGuard::note(PoseStatus verdict) {
  ++counts_[static_cast<std::size_t>(verdict)];
  return verdict;
}

std::uint64_t PoseGuard::refused() const {
  return std::accumulate(counts_.begin() + 1, counts_.end(), std::uint64_t{0});
}

PoseStatus PoseGuard::judge(NeedlePose& pose) {
  switch (find_defect(pose.X_WN)) {
    case PoseDefect::kNone:
      break;
    case PoseDefect::kNotFinite:
      return PoseStatus::kNotFinite;
    case PoseDefect::kOutOfRange:
      return PoseStatus::kOutOfRange;
    case PoseDefect::kNotRigid:
      return PoseStatus::kNotRigid;
  }
  if (pose.stamp_ns < 0) return PoseStatus::kOutOfOrder;  // before any clock's start; and no overflow below
  if (const PoseStatus refused = judge_time(pose); refused != PoseStatus::kAccepted) {
    if (!replaces_last(pose)) return refused;
    has_last_ = has_offset_ = false;
    judge_time(pose);
    is_provisional_ = false;  // four agree
  }
  refused_in_a_row_ = 0;
  has_last_ = true;
  last_stamp_ns_ = pose.stamp_ns;
  last_sequence_ = pose.sequence;
  make_rigid(pose.X_WN);
  return PoseStatus::kAccepted;
}

PoseStatus PoseGuard::judge_time(const NeedlePose& pose) {
  if (has_last_ && (pose.stamp_ns <= last_stamp_ns_ || pose.sequence <= last_sequence_))
    return PoseStatus::kOutOfOrder;
  return is_stale(pose) ? PoseStatus::kStale : PoseStatus::kAccepted;
}

/// Counts a pose refused for its time. Of a backlog that arrives at once the delays fall with each pose: they do not
/// agree.
bool PoseGuard::replaces_last(const NeedlePose& pose) {
  const std::int64_t offset_ns = pose.received_ns - pose.stamp_ns;
  const auto agrees = [&] {
    if (refused_in_a_row_ == 0 || pose.stamp_ns <= refused_stamp_ns_) return false;
    const std::int64_t off_ns =
        elapsed_ns(refused_offset_ns_, offset_ns) + elapsed_ns(offset_ns, refused_offset_ns_);
    return off_ns <= settings_.agreement_ns && off_ns <= (pose.stamp_ns - first_refused_stamp_ns_) / 2;
  };
  if (!agrees()) {
    refused_in_a_row_ = 0;
    refused_offset_ns_ = offset_ns;
    first_refused_stamp_ns_ = pose.stamp_ns;
    is_set_back_ = pose.stamp_ns <= last_stamp_ns_;
  }
  refused_stamp_ns_ = pose.stamp_ns;
  const bool may_replace = is_provisional_ || (is_set_back_ && pose.sequence > last_sequence_);
  return ++refused_in_a_row_ >= kPosesThatAgree && may_replace;
}

bool PoseGuard::is_stale(const NeedlePose& pose) {
  assert(pose.received_ns >= 0);
  const std::int64_t offset_ns = pose.received_ns - pose.stamp_ns;
  const std::int64_t drift_ns = (pose.received_ns - least_offset_at_ns_) / kDriftDivisor;
  // Offsets lie within ±2^63, their differences may not: compare before subtracting.
  if (!has_offset_ || offset_ns <= least_offset_ns_ + drift_ns) {
    is_provisional_ = !has_offset_ || elapsed_ns(offset_ns, least_offset_ns_) > settings_.agreement_ns;
    has_offset_ = true;
    least_offset_ns_ = offset_ns;
    least_offset_at_ns_ = pose.received_ns;
    return false;
  }
  const auto age_ns =
      static_cast<std::uint64_t>(offset_ns) -
      static_cast<std::uint64_t>(least_offset_ns_ + drift_ns);  // positive: modulo 2^64 is exact
  if (age_ns > static_cast<std::uint64_t>(settings_.stale_ns)) return true;
  is_provisional_ = false;
  return false;
}

}  // namespace brachy
