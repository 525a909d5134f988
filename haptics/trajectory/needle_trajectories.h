#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "haptics/trajectory/trajectory.h"

namespace brachy {

/// Most needles that one file may move; as many as a scene may have, and its probe.
inline constexpr std::size_t kMaxTrajectoryNeedles = 25;

/// The motions of several needles on one clock: that of their file, or several recordings of one session. A
/// needle is absent before its first sample and stays at its last one. Immutable.
///
/// Threads: any number may read.
class NeedleTrajectories {
 public:
  struct Needle {
    std::uint32_t id = 0;
    Trajectory motion;
  };

  /// At least one; ids strictly increasing.
  explicit NeedleTrajectories(std::vector<Needle> needles);

  const std::vector<Needle>& needles() const { return needles_; }
  std::size_t id_count() const { return needles_.back().id + std::size_t{1}; }  ///< 1 + the highest id
  double start_s() const { return start_s_; }  ///< the first sample of any needle
  double end_s() const { return end_s_; }      ///< the last sample of any
  double duration_s() const { return end_s_ - start_s_; }

  /// Trajectory::sample of needle `id`; nullopt before its first sample (less 1e-9 s) and for an unknown
  /// needle.
  /// Real-time: yes.
  std::optional<RigidTransform> sample(std::uint32_t id, double t_s) const;

  /// Trajectory::button of needle `id`; false for an unknown needle.
  /// Real-time: yes.
  bool button(std::uint32_t id, double t_s) const;
  bool button(std::uint32_t id, double after_s, double until_s) const;

  /// Every motion, as Trajectory::transformed.
  NeedleTrajectories transformed(const RigidTransform& X_VW) const;
  /// All motions with the same shift, which moves the mean of their dwelling points to p_W (mm).
  NeedleTrajectories centred_on(const Vec3& p_W) const;
  /// The same motions at other times: `time_of` maps each, and increases.
  NeedleTrajectories retimed(const std::function<double(double)>& time_of) const;
  /// The same motions `factor` (> 0) times as fast.
  NeedleTrajectories sped_up(double factor) const;

 private:
  const Trajectory* find(std::uint32_t id) const;  // null: unknown needle

  std::vector<Needle> needles_;
  double start_s_, end_s_;
};

/// The column of a trajectory file that moves several needles: their ids, 0 … 24. Last but for kButtonColumn.
inline constexpr std::string_view kNeedleColumn = "needle";

/// Reads a trajectory file of one needle or, with the column `needle`, of several: rows sorted by time, at
/// equal times rows of different needles. Without the column all rows are needle 0's. Otherwise as
/// parse_trajectory. Throws UserError "name:line: what; fix", also for a needle id ≥ `needle_count`.
NeedleTrajectories parse_trajectories(std::string_view text, const std::string& name,
                                      std::size_t needle_count = kMaxTrajectoryNeedles);

/// parse_trajectories of a file. Throws UserError, also where it is no readable regular file or too large.
NeedleTrajectories load_trajectories(const std::filesystem::path& file,
                                     std::size_t needle_count = kMaxTrajectoryNeedles);

/// What is odd about a trajectory that may still be meant, a sentence each with the fix: one sample, positions that
/// look like metres, times that look like milliseconds.
std::vector<std::string> doubts_about(const NeedleTrajectories& trajectories);

/// trajectory_row with the needle's id behind.
std::string trajectory_row(const TrajectorySample& sample, std::uint32_t needle);

/// Which optional columns a trajectory file has.
struct TrajectoryColumns {
  bool needle = false, button = false;
};

/// The first line of such a file, without the line end.
std::string trajectory_header(TrajectoryColumns columns);
/// A line of such a file: trajectory_row with what `columns` has behind.
std::string trajectory_row(const TrajectorySample& sample, std::uint32_t needle, TrajectoryColumns columns);

}  // namespace brachy
