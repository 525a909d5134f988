#include "haptics/devices/pose_guard.h"

#include <cassert>
#include <numeric>

#include "haptics/force/elapsed.h"
#include "haptics/trajectory/rigid_pose.h"

namespace brachy {

namespace {

constexpr std::int64_t kDriftDivisor = 5000;  // 200 ppm: twice what a bad quartz does
// Of stamps, in which a delay that many others share comes again also where a network hands poses on in bundles, as
// Nagle's algorithm does with those of 40 ms.
constexpr std::int64_t kBundlesNs = 100'000'000;
// After so many poses refused in a row, and so long, no clock that was set is to be expected any more: three delays
// may each have been compared in vain for kBundlesNs.
constexpr int kMostDoubts = 8;
constexpr std::int64_t kLongestDoubtNs = 4 * kBundlesNs;

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
    case PoseStatus::kMetres:
      return "pose is a thousandth of the last one: metres, it seems; send mm";
    case PoseStatus::kQuaternionOrder:
      return "pose is turned as the last one with its quaternion in another order; send one order, and "
             "connect "
             "again if that before was wrong";
  }
  return "unknown verdict";
}

std::string_view to_string(PoseFault fault) {
  switch (fault) {
    case PoseFault::kNotFinite:
      return "poses that are not finite are refused: send nothing while tracking is lost";
    case PoseFault::kFar:
      return "poses far away are refused: send positions in mm";
    case PoseFault::kNotRigid:
      return "poses that are no rotation are refused: send orthonormal right-handed ones";
    case PoseFault::kLate:
      return "late poses are refused: look at the network, and drop those that wait";
    case PoseFault::kDoubled:
      return "doubled poses are refused: send each once";
    case PoseFault::kReordered:
      return "reordered poses are refused: let their stamps ascend";
    case PoseFault::kMetres:
      return "poses in metres, it seems: send mm";
    case PoseFault::kQuaternionOrder:
      return "quaternions in another order, it seems: x, y, z, w is not w, x, y, z";
    case PoseFault::kClockSet:
      return "the clock of its poses was set: their delays are measured again";
    case PoseFault::kUnseen:
      return "missing poses: the tracker does not see the tool, and the needle stays where it was";
    case PoseFault::kForeign:
      return "foreign poses, of another needle or tool, are skipped: only a device moves a needle, and its "
             "own";
    case PoseFault::kTooMany:
      return "too many poses: those beyond max_poses_per_s are refused";
  }
  return "unknown fault";
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

PoseStatus PoseGuard::with_fault(PoseFault fault, PoseStatus status) {
  faults_ |= fault_bit(fault);
  return status;
}

PoseStatus PoseGuard::judge(NeedlePose& pose) {
  faults_ = 0;
  switch (find_defect(pose.X_WN)) {
    case PoseDefect::kNone:
      break;
    case PoseDefect::kNotFinite:
      return with_fault(PoseFault::kNotFinite, PoseStatus::kNotFinite);
    case PoseDefect::kOutOfRange:
      return with_fault(PoseFault::kFar, PoseStatus::kOutOfRange);
    case PoseDefect::kNotRigid:
      return with_fault(PoseFault::kNotRigid, PoseStatus::kNotRigid);
  }
  // Before any clock's start; and no overflow below.
  if (pose.stamp_ns < 0) return with_fault(PoseFault::kReordered, PoseStatus::kOutOfOrder);
  if (const PoseStatus refused = judge_time(pose); refused != PoseStatus::kAccepted) {
    if (!replaces_last(pose)) {
      doubt_time(pose, refused);
      return refused;
    }
    has_last_ = has_offset_ = false;
    judge_time(pose);
    is_provisional_ = false;  // four agree
    faults_ |= fault_bit(PoseFault::kClockSet);
    faults_in_doubt_ = 0;
  }
  refused_that_agree_ = 0;
  faults_ |= faults_in_doubt_;
  faults_in_doubt_ = 0;
  doubts_in_a_row_ = 0;
  const PosePlausibility::Verdict doubt = plausibility_.judge(pose.X_WN);
  if (doubt.fault) faults_ |= fault_bit(*doubt.fault);
  if (doubt.is_refused)
    return doubt.fault == PoseFault::kMetres ? PoseStatus::kMetres : PoseStatus::kQuaternionOrder;
  has_last_ = true;
  last_stamp_ns_ = pose.stamp_ns;
  last_sequence_ = pose.sequence;
  make_rigid(pose.X_WN);
  return PoseStatus::kAccepted;
}

/// A pose refused for its time is late, doubled or reordered, unless those after it show that a clock was set.
void PoseGuard::doubt_time(const NeedlePose& pose, PoseStatus refused) {
  PoseFault fault = PoseFault::kLate;
  if (refused == PoseStatus::kOutOfOrder)
    fault = pose.stamp_ns == last_stamp_ns_ ? PoseFault::kDoubled : PoseFault::kReordered;
  faults_in_doubt_ |= fault_bit(fault);
  if (doubts_in_a_row_++ == 0) first_doubt_ns_ = pose.received_ns;
  if (doubts_in_a_row_ < kMostDoubts || pose.received_ns - first_doubt_ns_ < kLongestDoubtNs) return;
  faults_ |= faults_in_doubt_;
  faults_in_doubt_ = 0;
}

PoseStatus PoseGuard::judge_time(const NeedlePose& pose) {
  if (has_last_ && (pose.stamp_ns <= last_stamp_ns_ || pose.sequence <= last_sequence_))
    return PoseStatus::kOutOfOrder;
  return is_stale(pose) ? PoseStatus::kStale : PoseStatus::kAccepted;
}

/// Counts a pose refused for its time, if its delay agrees with the first one's; one that was held up less becomes the
/// first. Of a backlog that arrives at once the delays fall with each pose: they do not agree.
bool PoseGuard::replaces_last(const NeedlePose& pose) {
  const std::int64_t offset_ns = pose.received_ns - pose.stamp_ns;
  const std::int64_t off_ns =
      elapsed_ns(refused_offset_ns_, offset_ns) + elapsed_ns(offset_ns, refused_offset_ns_);
  const std::int64_t since_first_ns = elapsed_ns(first_refused_stamp_ns_, pose.stamp_ns);
  const bool agrees = off_ns <= settings_.agreement_ns && off_ns <= since_first_ns / 2;
  const bool is_less_late = elapsed_ns(offset_ns, refused_offset_ns_) > settings_.agreement_ns;
  if (refused_that_agree_ == 0 || pose.stamp_ns <= refused_stamp_ns_ || is_less_late ||
      (!agrees && since_first_ns > kBundlesNs)) {
    refused_that_agree_ = 1;
    refused_offset_ns_ = offset_ns;
    first_refused_stamp_ns_ = pose.stamp_ns;
    is_set_back_ = pose.stamp_ns <= last_stamp_ns_;
  } else if (agrees) {
    ++refused_that_agree_;
  }
  refused_stamp_ns_ = pose.stamp_ns;
  const bool may_replace = is_provisional_ || (is_set_back_ && pose.sequence > last_sequence_);
  return refused_that_agree_ >= kPosesThatAgree && agrees && may_replace;
}

bool PoseGuard::is_stale(const NeedlePose& pose) {
  assert(pose.received_ns >= 0);
  const std::int64_t offset_ns = pose.received_ns - pose.stamp_ns;
  const std::int64_t drift_ns = (pose.received_ns - least_offset_at_ns_) / kDriftDivisor;
  // Offsets lie within ±2^63, their differences may not: compare before subtracting.
  if (!has_offset_ || offset_ns <= least_offset_ns_ + drift_ns) {
    // A first pose that came late looks like one of a clock that is set afterwards: several must have agreed.
    if (poses_agreed_ >= kPosesThatAgree && elapsed_ns(offset_ns, least_offset_ns_) > settings_.clock_step_ns)
      faults_ |= fault_bit(PoseFault::kClockSet);
    is_provisional_ = !has_offset_ || elapsed_ns(offset_ns, least_offset_ns_) > settings_.agreement_ns;
    if (is_provisional_) poses_agreed_ = 0;
    ++poses_agreed_;
    has_offset_ = true;
    least_offset_ns_ = offset_ns;
    least_offset_at_ns_ = pose.received_ns;
    return false;
  }
  const auto age_ns =
      static_cast<std::uint64_t>(offset_ns) -
      static_cast<std::uint64_t>(least_offset_ns_ + drift_ns);  // positive: modulo 2^64 is exact
  if (age_ns > static_cast<std::uint64_t>(settings_.stale_ns)) return true;
  if (age_ns <= static_cast<std::uint64_t>(settings_.agreement_ns)) ++poses_agreed_;
  is_provisional_ = false;
  return false;
}

}  // namespace brachy
