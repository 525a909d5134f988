#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// One row of a trajectory.
struct TrajectorySample {
  double t_s = 0;
  RigidTransform X_WN;  ///< needle frame N (origin = tip, +z along the shaft towards the tip) in world W, mm
  bool button = false;  ///< the device's, held from here to the next sample
  bool operator==(const TrajectorySample&) const = default;
};

/// Times this near to a sample's are the sample's, s.
inline constexpr double kSameTime = 1e-9;

/// A needle's motion: poses at strictly increasing times, at least one. Immutable.
///
/// Threads: any number may read.
class Trajectory {
 public:
  /// The poses have no defect (haptics/trajectory/rigid_pose.h); times are finite and strictly increasing.
  explicit Trajectory(std::vector<TrajectorySample> samples);

  const std::vector<TrajectorySample>& samples() const { return samples_; }
  double start_s() const { return samples_.front().t_s; }
  double end_s() const { return samples_.back().t_s; }
  double duration_s() const { return end_s() - start_s(); }

  /// The pose X_WN at t_s: position linear, rotation by slerp between the neighbours; before the first sample
  /// and after the last one these are held. Within 1e-9 s of a sample, and between two of one pose, it is that pose,
  /// bit for bit.
  ///
  /// Real-time: yes, O(log samples).
  RigidTransform sample(double t_s) const;

  /// Whether the button is held at t_s: according to the last sample at or before it (less 1e-9 s); false
  /// before the first one.
  ///
  /// Real-time: yes, O(log samples).
  bool button(double t_s) const;

  /// The button for a tick at until_s after one at after_s < until_s: held at until_s, or pressed by a sample
  /// in between, so that no press is too short to be seen; a press released since after_s was seen by that
  /// tick. Samples at ticks are thus seen unchanged. A release between two ticks is not seen.
  ///
  /// Real-time: yes, O(log samples + samples in between).
  bool button(double after_s, double until_s) const;

  /// Length of the polyline of tip positions, mm.
  double tip_path_mm() const;

  /// The same motion seen in another frame V: poses X_VN = X_VW · X_WN. X_VW is rigid to 1e-9.
  Trajectory transformed(const RigidTransform& X_VW) const;

  /// The dwelling point: the median of the tip's positions over time, each coordinate separately, mm. An
  /// insertion dwells in the tissue, however long its approach.
  Vec3 dwelling_point() const;

  /// The same motion shifted so that its dwelling point is p_W (mm).
  Trajectory centred_on(const Vec3& p_W) const;

 private:
  std::vector<TrajectorySample> samples_;
};

/// The first line of a trajectory file: seconds, then the 3×4 matrix of X_WN row by row, mm.
inline constexpr std::string_view kTrajectoryHeader = "t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23";

/// The last column of a trajectory file with a button: 0 or 1.
inline constexpr std::string_view kButtonColumn = "button";

/// Limits of a file; an hour of motion at 200 Hz has 720,000 samples and about 180 MB.
inline constexpr std::size_t kMaxTrajectorySamples = 4'000'000;
inline constexpr std::size_t kMaxTrajectoryBytes = std::size_t{1100} << 20;

/// Reads a trajectory from the text of a CSV file, with or without kButtonColumn; `name` names it in errors.
///
/// Lines that are blank or start with '#' are skipped; lines end with LF or CRLF, the last one need not end
/// at all. A rotation within 1e-3 of a rigid one is replaced by the nearest rotation, within 1e-9 it is kept
/// bitwise. Throws UserError "name:line: what; fix".
Trajectory parse_trajectory(std::string_view text, const std::string& name);

/// parse_trajectory of a file. Throws UserError, also where it is no readable regular file or too large.
Trajectory load_trajectory(const std::filesystem::path& file);

/// One line of a trajectory file without button and line end: 17 significant digits, so that reading it gives
/// the same bits.
std::string trajectory_row(const TrajectorySample& sample);

/// Header and rows, with kButtonColumn if the button is ever held; what parse_trajectory reads back bit for
/// bit. The caller checks the stream.
void write_trajectory(std::ostream& out, const Trajectory& trajectory);

}  // namespace brachy
