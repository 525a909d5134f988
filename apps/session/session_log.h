#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/forces/force_log.h"
#include "apps/forces/row_file.h"
#include "apps/session/seed_ledger.h"
#include "core/sim/mesh_state.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

/// A pose that the simulation used, and whose.
struct UsedPose {
  std::uint32_t needle = 0;
  TickPose pose;
};

/// A recording while it is being written: a folder with poses.csv (every tick's poses, a trajectory that replays), forces.csv
/// (apps/forces) and seeds.csv (the ledger). What `brachy score` reads.
///
/// A folder that holds one already is gone on with: its seeds are `restored()`, rows that a killed process left unfinished
/// are cut off, and times go on from the last pose's.
/// Threads: one; sync_seeds() any other.
class SessionLog {
 public:
  /// Makes the folder. Throws UserError where it cannot be written or what it holds is no recording of such a scene.
  SessionLog(const std::filesystem::path& folder, std::size_t needle_count, double period_s);

  /// Whether a folder holds (part of) a recording.
  static bool is_recording(const std::filesystem::path& folder);

  const std::vector<Seed>& restored() const { return ledger_.restored(); }
  double offset_s() const { return offset_s_; }  ///< of this run's time 0 in the files
  /// What was found and mended; empty: nothing.
  const std::string& restored_text() const { return restored_text_; }

  /// What `state` has that is new since the last call: the poses as far back as its histories go, its seeds, and its forces.
  /// The seeds come first. Throws std::runtime_error where these could not be written; they are tried again next time.
  void add(const MeshState& state);

  // The same in parts, for what came over the wire.
  void add_seeds(std::span<const Seed> seeds) { ledger_.append(seeds, offset_s_); }
  /// In any order; those of ticks already written are left out.
  void add_poses(std::vector<UsedPose> poses);
  void add_forces(std::uint64_t tick, std::uint32_t needle, const NeedleState& state, double min_det);
  /// Throws std::runtime_error, naming the file, once, where poses or forces cannot be written any more: whole rows stay,
  /// later ones are left out.
  void flush();
  void sync_seeds() const noexcept { ledger_.sync(); }

  /// Closes the files. Throws std::runtime_error, naming the file, where poses or forces could not all be written.
  void close();

  std::uint64_t poses() const { return poses_->rows(); }
  std::uint64_t forces() const { return forces_.rows(); }
  std::size_t seeds() const { return ledger_.count(); }
  std::uint64_t ticks_missed() const { return ticks_missed_; }  ///< whose poses came too late to be known

 private:
  double time_of(std::uint64_t tick) const { return offset_s_ + static_cast<double>(tick) * period_s_; }
  void open_poses();
  std::string failure() const;  // of poses or forces; empty: none

  std::filesystem::path folder_;
  double period_s_;
  TrajectoryColumns columns_;
  double offset_s_ = 0;
  SeedLedger ledger_;
  ForceLogWriter forces_;
  std::optional<RowFile> poses_;
  bool has_told_ = false;  // that poses or forces cannot be written
  std::string restored_text_;
  std::uint64_t last_tick_ = 0, ticks_missed_ = 0;
};

}  // namespace brachy
