#include <cmath>
#include <ostream>
#include <sstream>
#include <utility>

#include "core/number_csv.h"
#include "haptics/rigid_pose.h"
#include "haptics/trajectory.h"

namespace brachy {

namespace {

constexpr double kMaxTime = 4e9;  // seconds since 1970 are fine, and fit 64 bits in ns
constexpr NumberCsvLimits kLimits{kMaxTrajectoryBytes, kMaxTrajectorySamples};

std::string short_number(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

RigidTransform to_pose(std::span<const double> row, const std::string& name, std::size_t line) {
  RigidTransform X_WN;
  for (int i = 0; i < 3; ++i) {
    const std::size_t first = 1 + 4 * static_cast<std::size_t>(i);
    X_WN.R.row(i) << row[first], row[first + 1], row[first + 2];
    X_WN.p[i] = row[first + 3];
  }
  switch (find_defect(X_WN)) {
    case PoseDefect::kNone:
    case PoseDefect::kNotFinite:  // parse_number_csv has refused it
      break;
    case PoseDefect::kOutOfRange:
      refuse_line(name, line,
                  "the tip is more than " + short_number(kMaxTipOffset / 1e3) +
                      " m from the origin; positions (m03, m13, m23) are in mm");
    case PoseDefect::kNotRigid:
      refuse_line(name, line,
                  "the 3×3 part is not a rotation within " + short_number(kRigidTolerance) +
                      "; it must be orthonormal, right-handed and without scale, written row by row");
  }
  make_rigid(X_WN);
  return X_WN;
}

Trajectory to_trajectory(const NumberTable& table, const std::string& name) {
  std::vector<TrajectorySample> samples;
  samples.reserve(table.rows());
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const std::size_t line = table.lines[i];
    const double t_s = table.row(i)[0];
    if (std::abs(t_s) > kMaxTime)
      refuse_line(name, line, "t_s " + short_number(t_s) + " is too large; it is in seconds");
    if (!samples.empty() && !(t_s > samples.back().t_s))
      refuse_line(name, line, "t_s does not increase; sort the rows and remove those with equal times");
    samples.push_back({t_s, to_pose(table.row(i), name, line)});
  }
  return Trajectory(std::move(samples));
}

}  // namespace

Trajectory parse_trajectory(std::string_view text, const std::string& name) {
  return to_trajectory(parse_number_csv(text, name, kTrajectoryHeader, kLimits), name);
}

Trajectory load_trajectory(const std::filesystem::path& file) {
  return to_trajectory(load_number_csv(file, kTrajectoryHeader, kLimits), file.string());
}

std::string trajectory_row(const TrajectorySample& sample) {
  const Mat3& R = sample.X_WN.R;
  const Vec3& p = sample.X_WN.p;
  const double row[] = {sample.t_s, R(0, 0), R(0, 1), R(0, 2), p[0],    R(1, 0), R(1, 1),
                        R(1, 2),    p[1],    R(2, 0), R(2, 1), R(2, 2), p[2]};
  std::string text;
  append_csv_row(text, row);
  return text;
}

void write_trajectory(std::ostream& out, const Trajectory& trajectory) {
  out << kTrajectoryHeader << '\n';
  for (const TrajectorySample& sample : trajectory.samples()) out << trajectory_row(sample) << '\n';
}

}  // namespace brachy
