#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/forces/force_log.h"
#include "apps/forces/row_file.h"
#include "apps/session/earlier_session.h"
#include "apps/session/seed_ledger.h"
#include "apps/session/session_states.h"
#include "core/simulation/mesh_state.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

/// A pose that the simulation used, and its needle.
struct UsedPose {
  std::uint32_t needle = 0;
  TickPose pose;
};

/// A recording while it is being written: a directory with poses.csv (every tick's poses, a trajectory that
/// replays; of a needle at rest the first and the last row), forces.csv (apps/forces), seeds.csv (the ledger),
/// drops.csv (seeds that were lost or refused), contacts.csv (passes through organs) and, of states that a loop
/// published, clock.csv (SessionClock). `brachy score` reads it. An existing recording is continued: its seeds are
/// `restored()`, rows that a killed process left unfinished are truncated, and times continue from the latest in the
/// three files, whose last rows are checked. Files and directory are treated as untrusted (session_folder.h). Threads:
/// one; sync_seeds() any other.
class SessionLog {
 public:
  /// kLater: the directory is created, locked and examined; nothing in it is changed before begin().
  enum class Start { kAtOnce, kLater };

  /// Creates the directory. Throws UserError if it cannot be written or holds a recording of a different
  /// scene: then nothing in it has changed.
  /// `organs`: names of SimulationModel::organs; none: the data come over the wire, and drops.csv and contacts.csv are
  /// not written.
  SessionLog(const std::filesystem::path& folder, std::size_t needle_count, double period_s,
             std::optional<std::vector<std::string>> organs = {}, Start start = Start::kAtOnce);

  /// Creates and repairs the files. Once, before anything is added. Throws UserError where they cannot be written.
  void begin();

  /// Whether a directory holds (part of) a recording.
  static bool is_recording(const std::filesystem::path& folder);

  const SessionFolder& folder() const { return folder_; }
  const std::vector<Seed>& restored() const { return earlier_.seeds; }
  /// Planned seeds that an earlier run lost: they are no longer in their needles.
  const std::vector<std::int32_t>& restored_lost() const { return earlier_.lost; }
  double offset_s() const { return earlier_.end_s; }  ///< time of this run's start in the files, s
  /// What was found and repaired; empty: nothing.
  const std::string& restored_text() const { return restored_text_; }

  /// Writes what is new in `state` since the last call: the poses as far back as its histories go, its seeds,
  /// its forces, and what happened to organs. The seeds are written first. Throws std::runtime_error if seeds
  /// cannot be written; the
  /// next call retries them.
  void add(const MeshState& state);
  /// Keeps the state of the simulator after tick `tick` (session_states.h). Throws std::runtime_error.
  void add_state(std::uint64_t tick, std::span<const std::byte> bytes) const {
    write_session_state(folder_, time_of(tick), bytes);
  }

  // The same in parts, for data received over the wire.
  void add_seeds(std::span<const Seed> seeds) { ledger_->append(seeds, offset_s()); }
  /// In any order; poses of ticks already written are ignored.
  void add_poses(std::vector<UsedPose> poses);
  void add_forces(std::uint64_t tick, std::uint32_t needle, const NeedleState& state, double min_det);
  /// Throws std::runtime_error with the file, once, if poses or forces can no longer be written: complete
  /// rows stay, later ones are dropped.
  void flush();
  void sync_seeds() const noexcept {
    if (ledger_) ledger_->sync();
  }

  /// Of passes under way what is known so far is written. Closes the files. Throws std::runtime_error with the file
  /// if poses or forces could not all be written.
  void close();

  std::uint64_t poses() const { return poses_ ? poses_->rows() : 0; }
  std::uint64_t forces() const { return forces_ ? forces_->rows() : 0; }
  std::size_t seeds() const { return ledger_ ? ledger_->count() : earlier_.seeds.size(); }
  std::uint64_t ticks_missed() const {
    return ticks_missed_;
  }  ///< ticks whose poses are missing: they were no longer in the history

 private:
  void add_clock(const TickSummary& summary);
  void write_clock();
  void write_poses(std::vector<UsedPose> poses);
  void add_row(const UsedPose& used);
  void add_failed_drops(const FailedDrops& drops);
  void add_contacts(const MeshState& state);
  double time_of(std::uint64_t tick) const { return offset_s() + static_cast<double>(tick) * period_s_; }
  void tell(const std::string& what);
  std::string failure() const;  // of poses or forces; empty: none

  SessionFolder folder_;
  double period_s_;
  TrajectoryColumns columns_;
  EarlierSession earlier_;
  std::optional<std::vector<std::string>> organs_;
  // From begin() on:
  std::optional<SeedLedger> ledger_;
  std::optional<ForceLogWriter> forces_;
  std::optional<RowFile> poses_, drops_, contacts_, clock_;
  std::uint64_t drops_written_ = 0;
  std::vector<OrganContact> last_contacts_;  // as MeshState's
  std::uint64_t run_ = 0;                    // TickSummary::run of the last state
  bool has_reported_ = false;                // that poses or forces cannot be written
  std::string restored_text_;
  std::uint64_t last_tick_ = 0, ticks_missed_ = 0;
  // Of each needle: the last pose that was written, and the same one at rest since, which is not.
  struct LastPose {
    std::optional<TickPose> written, resting;
  };
  std::vector<LastPose> last_poses_;
  double wall_start_s_ = 0;                    // at first_publish_ns_
  double newest_s_ = 0, newest_wall_s_ = 0;    // of the last state
  double last_clock_s_ = 0, last_late_s_ = 0;  // of the last row
  std::int64_t first_publish_ns_ = 0;
};

}  // namespace brachy
