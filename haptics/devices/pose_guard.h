#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/needle/needle_pose.h"
#include "haptics/devices/pose_plausibility.h"

namespace brachy {

/// Result of the check of a pose. Sent over the wire and used as an index of counters: append only.
enum class PoseStatus : std::uint8_t {
  kAccepted = 0,
  kNotFinite = 1,
  kNotRigid = 2,
  kStale = 3,
  kOutOfOrder = 4,
  kOutOfRange = 5,
  kNotAttached = 6,  ///< no device holds the lease (NetworkDevice)
  kMetres = 7,
  kQuaternionOrder = 8,
};
inline constexpr std::size_t kPoseStatuses = 9;

/// A sentence for the sender that names the fix.
std::string_view to_string(PoseStatus verdict);

struct PoseGuardSettings {
  /// Age at which a pose is refused, ns, > 0.
  std::int64_t stale_ns = 100'000'000;
  /// By this much delays may differ that agree, ns, > 0; below the least by more a pose is provisional.
  std::int64_t agreement_ns = 25'000'000;
  /// A clock that is ahead by more at once, after four poses that agreed, was set, ns, > 0.
  std::int64_t clock_step_ns = 250'000'000;
  /// Against which a pose is judged whose quaternion is in another order.
  TissueBall tissue = {};
};

/// Judges the poses of one device as they arrive; the simulation only ever sees accepted ones.
///
/// A device stamps poses with its own clock, of unknown offset. The smallest difference arrival − stamp of
/// the poses in order is taken as the offset plus the shortest transmission time; a pose's age is the excess
/// over that. The smallest difference grows by 200 parts per million of the time since it was measured, so
/// that poses of a device with a slower clock do not become stale within the hour.
///
/// A pose stamped ahead of its device's clock makes those after it stale or back in time. So one whose difference is
/// far below the smallest so far, or that is the first, is provisional until another one is accepted. While it is,
/// four poses refused for their time, with no other between them, whose delays agree replace it. Poses whose sequence
/// goes on while their stamps go back are of a clock that was set back, as NTP does: four that agree are a new offset,
/// also where a network hands them on in bundles. Where it was set back by less than a pose's distance from the one
/// before, they cannot be told from late ones: those older than stale_ns are refused until the next reset, that is,
/// until the device connects again.
///
/// Threads: one, the io thread.
///
/// Real-time: O(1), no allocation.
class PoseGuard {
 public:
  explicit PoseGuard(const PoseGuardSettings& settings = {})
      : settings_(settings), plausibility_(settings.tissue) {}

  /// Judges `pose`, of which X_WN, sequence, stamp_ns and received_ns are set, and counts the status.
  ///
  /// Refused are, in this order: NaN and infinity; a tip beyond ±10 m in x, y or z; a rotation off by more
  /// than 1e-3 or left-handed; a sequence or a stamp not after the last accepted one's, or a negative stamp;
  /// a pose older than stale_ns; one in metres or with its quaternion in another order (PosePlausibility). An
  /// accepted pose stays as it is bit for bit, unless its rotation is off by 1e-9 to 1e-3: then it is replaced
  /// by the nearest rotation.
  PoseStatus check(NeedlePose& pose);

  /// How many poses had this status since construction (a reset does not clear the counters).
  std::uint64_t count(PoseStatus verdict) const { return counts_[static_cast<std::size_t>(verdict)]; }
  /// All but the accepted ones.
  std::uint64_t refused() const;
  /// Counts a status determined elsewhere.
  PoseStatus note(PoseStatus verdict);

  /// fault_bit()s of what is known to be wrong since the last pose was checked: with it, or, where it takes a later
  /// pose to tell a late or reordered one from a clock that was set, with those before.
  std::uint32_t faults() const { return faults_; }
  /// Of those before, what is not yet told: for a device that leaves.
  std::uint32_t faults_in_doubt() const { return faults_in_doubt_; }

  /// A new device: forgets the last stamp and sequence and the clock offset.
  void reset() {
    has_last_ = has_offset_ = is_provisional_ = false;
    poses_agreed_ = 0;
    faults_ = faults_in_doubt_ = 0;
    plausibility_.reset();
  }

  /// So many poses refused for their time that agree replace a provisional one.
  static constexpr int kPosesThatAgree = 4;

 private:
  PoseStatus judge(NeedlePose& pose);
  PoseStatus judge_time(const NeedlePose& pose);
  bool is_stale(const NeedlePose& pose);
  bool replaces_last(const NeedlePose& pose);
  PoseStatus with_fault(PoseFault fault, PoseStatus status);
  void doubt_time(const NeedlePose& pose, PoseStatus refused);

  PoseGuardSettings settings_;
  bool has_last_ = false;
  std::uint64_t last_sequence_ = 0;
  std::int64_t last_stamp_ns_ = 0;
  bool has_offset_ = false;
  std::int64_t least_offset_ns_ = 0;     // arrival − stamp
  std::int64_t least_offset_at_ns_ = 0;  // arrival of the pose that showed it
  int poses_agreed_ = 0;                 // accepted with that offset, but for agreement_ns
  bool is_provisional_ = false;          // the last accepted pose is
  bool is_set_back_ = false;    // the first of those refused has a stamp before the last accepted one's
  int refused_that_agree_ = 0;  // with the first of them, which counts; 0: none
  std::int64_t refused_offset_ns_ = 0;  // of the first of them
  std::int64_t first_refused_stamp_ns_ = 0;
  std::int64_t refused_stamp_ns_ = 0;  // of the last of them
  PosePlausibility plausibility_;
  std::uint32_t faults_ = 0, faults_in_doubt_ = 0;
  int doubts_in_a_row_ = 0;
  std::int64_t first_doubt_ns_ = 0;  // arrival of the first of them
  std::array<std::uint64_t, kPoseStatuses> counts_{};
};

}  // namespace brachy
