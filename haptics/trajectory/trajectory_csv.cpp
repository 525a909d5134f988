#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>
#include <sstream>
#include <utility>

#include "core/base/file_kind.h"
#include "core/base/number_csv.h"
#include "haptics/trajectory/needle_trajectories.h"
#include "haptics/trajectory/rigid_pose.h"

namespace brachy {

namespace {

/// In place of a matrix; q_WN.
constexpr std::array<std::string_view, 2> kQuaternionHeaders = {"t_s,x,y,z,qw,qx,qy,qz",
                                                                "t_s,x,y,z,qx,qy,qz,qw"};
constexpr double kMaxTime = 4e9;  // seconds since 1970 are fine, and fit 64 bits in ns
constexpr std::array kOneNeedlesColumns = {kButtonColumn};
constexpr std::array kSeveralNeedlesColumns = {kNeedleColumn, kButtonColumn};
constexpr NumberCsvLimits kLimits{kMaxTrajectoryBytes, kMaxTrajectorySamples, kOneNeedlesColumns};
constexpr NumberCsvLimits kSeveralLimits{kMaxTrajectoryBytes, kMaxTrajectorySamples, kSeveralNeedlesColumns};

std::string short_number(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

/// A table of matrices, of the file's own or of its unit quaternions.
NumberTable parse_poses(std::string_view text, const std::string& name, const NumberCsvLimits& limits) {
  const std::string header = csv_header(text);
  const auto by_names =
      std::ranges::find_if(kQuaternionHeaders, [&](std::string_view h) { return header.starts_with(h); });
  if (by_names == kQuaternionHeaders.end()) return parse_number_csv(text, name, kTrajectoryHeader, limits);
  const NumberTable from = parse_number_csv(text, name, *by_names, limits);
  const std::size_t w = by_names == kQuaternionHeaders.begin() ? 4 : 7, x = w == 4 ? 5 : 4;
  NumberTable to;
  to.lines = from.lines;
  to.optional_columns = from.optional_columns;
  to.columns = 13 + from.optional_columns.size();
  to.values.reserve(to.columns * from.rows());
  for (std::size_t i = 0; i < from.rows(); ++i) {
    const auto row = from.row(i);
    const Eigen::Quaterniond q(row[w], row[x], row[x + 1], row[x + 2]);
    if (!(std::abs(q.norm() - 1) <= kRigidTolerance))
      refuse_line(
          name, from.lines[i],
          "the quaternion's length is " + short_number(q.norm()) + "; it must be 1, named qw, qx, qy, qz");
    const Mat3 R = q.normalized().toRotationMatrix();
    to.values.push_back(row[0]);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) to.values.push_back(R(r, c));
      to.values.push_back(row[1 + static_cast<std::size_t>(r)]);
    }
    to.values.insert(to.values.end(), row.begin() + 8, row.end());
  }
  return to;
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

double to_time(std::span<const double> row, const std::string& name, std::size_t line) {
  if (std::abs(row[0]) > kMaxTime)
    refuse_line(name, line, "t_s " + short_number(row[0]) + " is too large; it is in seconds");
  return row[0];
}

bool to_button(const NumberTable& table, std::size_t i, const std::string& name) {
  const double button = table.optional(i, kButtonColumn).value_or(0);
  if (button != 0 && button != 1)
    refuse_line(name, table.lines[i],
                "button " + short_number(button) + " is neither up nor down; write 0 or 1 (held)");
  return button == 1;
}

Trajectory to_trajectory(const NumberTable& table, const std::string& name) {
  std::vector<TrajectorySample> samples;
  samples.reserve(table.rows());
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const std::size_t line = table.lines[i];
    const double t_s = to_time(table.row(i), name, line);
    if (!samples.empty() && !(t_s > samples.back().t_s))
      refuse_line(name, line, "t_s does not increase; sort the rows and remove those with equal times");
    samples.push_back({t_s, to_pose(table.row(i), name, line), to_button(table, i, name)});
  }
  return Trajectory(std::move(samples));
}

std::uint32_t to_needle(double id, std::size_t needle_count, const std::string& name, std::size_t line) {
  if (!(id >= 0 && id < static_cast<double>(kMaxTrajectoryNeedles) && id == std::floor(id)))
    refuse_line(name, line,
                "needle " + short_number(id) + " is no needle's id; they are whole numbers from 0 to " +
                    std::to_string(kMaxTrajectoryNeedles - 1));
  const auto needle = static_cast<std::uint32_t>(id);
  if (needle >= needle_count)
    refuse_line(name, line,
                "moves needle " + std::to_string(needle) + ", and the scene has " +
                    (needle_count == 1 ? "needle 0 alone" : std::to_string(needle_count) + " from 0 on") +
                    "; raise needle.count in the scene to " + std::to_string(needle + 1) + " or more");
  return needle;
}

NeedleTrajectories to_trajectories(const NumberTable& table, const std::string& name,
                                   std::size_t needle_count) {
  std::array<std::vector<TrajectorySample>, kMaxTrajectoryNeedles> samples;
  std::array<std::size_t, kMaxTrajectoryNeedles> rows{};  // a long session's samples are moved otherwise
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const double id = table.optional(i, kNeedleColumn).value_or(0);
    if (id >= 0 && id < static_cast<double>(kMaxTrajectoryNeedles)) ++rows[static_cast<std::size_t>(id)];
  }
  for (std::size_t id = 0; id < rows.size(); ++id) samples[id].reserve(rows[id]);
  double last_s = -kMaxTime;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const std::size_t line = table.lines[i];
    const double t_s = to_time(table.row(i), name, line);
    const std::uint32_t id =
        to_needle(table.optional(i, kNeedleColumn).value_or(0), needle_count, name, line);
    auto& own = samples[id];
    if (!own.empty() && !(t_s > own.back().t_s))
      refuse_line(name, line,
                  "t_s does not increase for needle " + std::to_string(id) +
                      "; sort the rows and remove those with equal times");
    if (t_s < last_s)
      refuse_line(name, line,
                  "t_s goes back to " + short_number(t_s) + "; sort the rows of all needles by time");
    last_s = t_s;
    own.push_back({t_s, to_pose(table.row(i), name, line), to_button(table, i, name)});
  }
  std::vector<NeedleTrajectories::Needle> needles;
  for (std::uint32_t id = 0; id < samples.size(); ++id)
    if (!samples[id].empty()) needles.push_back({id, Trajectory(std::move(samples[id]))});
  return NeedleTrajectories(std::move(needles));
}

}  // namespace

Trajectory parse_trajectory(std::string_view text, const std::string& name) {
  return to_trajectory(parse_poses(text, name, kLimits), name);
}

Trajectory load_trajectory(const std::filesystem::path& file) {
  return reading(file, FileKind::kTrajectory, [&] {
    return to_trajectory(
        parse_poses(load_csv_text(file, kTrajectoryHeader, kLimits.max_bytes), file.string(), kLimits),
        file.string());
  });
}

NeedleTrajectories parse_trajectories(std::string_view text, const std::string& name,
                                      std::size_t needle_count) {
  return to_trajectories(parse_poses(text, name, kSeveralLimits), name, needle_count);
}

NeedleTrajectories load_trajectories(const std::filesystem::path& file, std::size_t needle_count) {
  return reading(file, FileKind::kTrajectory, [&] {
    return to_trajectories(parse_poses(load_csv_text(file, kTrajectoryHeader, kSeveralLimits.max_bytes),
                                       file.string(), kSeveralLimits),
                           file.string(), needle_count);
  });
}

std::string trajectory_row(const TrajectorySample& sample, std::uint32_t needle) {
  return trajectory_row(sample) + ',' + std::to_string(needle);
}

std::string trajectory_header(TrajectoryColumns columns) {
  std::string header(kTrajectoryHeader);
  if (columns.needle) (header += ',') += kNeedleColumn;
  if (columns.button) (header += ',') += kButtonColumn;
  return header;
}

std::string trajectory_row(const TrajectorySample& sample, std::uint32_t needle, TrajectoryColumns columns) {
  std::string row = columns.needle ? trajectory_row(sample, needle) : trajectory_row(sample);
  if (columns.button) row += sample.button ? ",1" : ",0";
  return row;
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
  const auto& samples = trajectory.samples();
  const TrajectoryColumns columns{.button = std::ranges::any_of(samples, &TrajectorySample::button)};
  out << trajectory_header(columns) << '\n';
  for (const TrajectorySample& sample : samples) out << trajectory_row(sample, 0, columns) << '\n';
}

}  // namespace brachy
