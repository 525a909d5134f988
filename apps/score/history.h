#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace brachy {

/// A scored session in a row of figures; kNoNumber where one is not known. Of a fraction of HDR, errors are those of
/// dwell positions, along the needle of tips, and catheters are counted.
struct HistoryRow {
  std::string session;  ///< of its directory
  std::string task;     ///< its exercise's name, else its scene's file; empty: not known (no session.json)
  std::string began;    ///< UTC; empty: not known
  double mean_error_mm = 0, axial_error_mm = 0, placed = 0, missing = 0, extra = 0;
  double time_s = 0, passes = 0, organ_passes = 0, speed_p95_mm_s = 0;
  double v100_percent = 0, d90_gy = 0, urethra_d30_gy = 0, rectum_d2cc_gy = 0;
  double findings = 0;
};

/// A trainee's sessions by task, then by when they began or, where that is not known, by their directories' names
/// (numbers in them as numbers), and what could not be read, a sentence each.
struct History {
  std::vector<HistoryRow> rows;
  std::vector<std::string> remarks;
};

/// Reads hdr_report.json, else report.json, of every directory in `folder`. Throws UserError where it is no directory
/// or has no scored session.
History load_history(const std::filesystem::path& folder);

/// The sessions of each task apart, in their order: figures of one say nothing about another.
std::vector<History> by_task(const History& history);

/// A figure's course over the sessions: a straight line by least squares.
struct Trend {
  std::string name;            ///< "mean_error_mm", a column of the CSV
  double first = 0, last = 0;  ///< of the sessions
  double per_session = 0;      ///< slope
  double instructor = 0;       ///< mean of the instructor's sessions; kNoNumber: none
};
/// Precondition: the sessions are of one task.
std::vector<Trend> trends_of(const History& trainee, const History* instructor);

/// For a terminal, task by task; the instructor's are those of the same task.
std::string to_text(const History& trainee, const History* instructor);
/// A header and a row for each session; an unknown figure is empty.
std::string to_csv(const History& history);

}  // namespace brachy
