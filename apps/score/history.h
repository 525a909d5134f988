#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/score/learning_curve.h"
#include "apps/score/spread.h"

namespace brachy {

/// A scored session in a row of figures; kNoNumber where one is not known. Of a fraction of HDR, errors are those of
/// dwell positions, along the needle of tips, and catheters are counted.
struct HistoryRow {
  std::filesystem::path folder;  ///< its directory
  std::string session;           ///< the directory's name
  std::string trainee;  ///< as session.json has it, else the name of the directory around; empty: not known
  std::string task;     ///< its exercise's name, else its scene's file; empty: not known (no session.json)
  std::string began;    ///< UTC; empty: not known
  std::optional<bool>
      has_passed;  ///< its exercise; none: it is of none, or was scored before reports said so
  std::vector<std::string> bounds;          ///< of the exercise: "mean error 0.4 mm, at most 2"
  std::vector<std::string> first_findings;  ///< the heaviest, at most kHistoryFindings
  double mean_error_mm = 0, axial_error_mm = 0, placed = 0, missing = 0, extra = 0;
  double time_s = 0, passes = 0, organ_passes = 0, speed_p95_mm_s = 0;
  double v100_percent = 0, d90_gy = 0, urethra_d30_gy = 0, rectum_d2cc_gy = 0;
  double findings = 0;
};

inline constexpr std::size_t kHistoryFindings = 3;

/// Sessions by trainee, by task, then by when they began or, where that is not known, by their directories' names
/// (numbers in them as numbers), and what could not be read, a sentence each.
struct History {
  std::vector<HistoryRow> rows;
  std::vector<std::string> remarks;
};

/// Reads hdr_report.json, else report.json, of every directory in `folder`. Throws UserError where it is no directory
/// or has no scored session.
History load_history(const std::filesystem::path& folder);

/// Reads the sessions of a class: those in `folder`, and those in its other directories, each of which is a trainee's
/// and names him where session.json does not. Throws UserError as load_history.
History load_class(const std::filesystem::path& folder);

/// The directories that hold a session: those in `folder`, and those in its other directories; in the order of their
/// paths. Throws UserError where it is no directory.
std::vector<std::filesystem::path> session_folders(const std::filesystem::path& folder);

/// The sessions of each trainee and task apart, in their order: figures of one say nothing about another.
std::vector<History> by_task(const History& history);

/// Quartiles by linear interpolation between the sorted values (Hyndman, Fan, Am. Stat. 50, 1996, 361–365, type 7);
/// kNoNumber where there are no values.
struct Quartiles {
  std::size_t count = 0;
  double first = kNoNumber, median = kNoNumber, third = kNoNumber;
};
Quartiles quartiles_of(std::vector<double> values);

/// What a trainee is compared with: sessions of others, each task for itself. Null: nobody's.
struct Peers {
  const History* instructor = nullptr;  ///< all of their sessions count
  const History* cohort = nullptr;      ///< of each other trainee the last session of a task
};

/// A figure's course over the sessions.
struct Trend {
  std::string name;            ///< "mean_error_mm", a column of the CSV
  double first = 0, last = 0;  ///< of the sessions
  double per_session = 0;      ///< slope of a straight line by least squares
  std::optional<LearningCurve> curve;
  Quartiles instructor, cohort;
};
/// Precondition: the sessions are one trainee's, of one task.
std::vector<Trend> trends_of(const History& trainee, const Peers& peers);

/// For a terminal, task by task; peers are those of the same task.
std::string to_text(const History& trainee, const Peers& peers);
/// A header and a row for each session; an unknown figure is empty.
std::string to_csv(const History& history);
/// Cells of its kind: a figure with `digits` places, `unknown` where it is not finite; "yes", "no" or, not known, "".
std::string figure_or(double value, int digits, const char* unknown);
std::string yes_or_no(const std::optional<bool>& value);
/// A text: with a comma, a quote or a line's end it is quoted, as RFC 4180 has it.
std::string csv_cell(const std::string& text);

}  // namespace brachy
