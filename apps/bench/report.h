#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace brachy::bench {

/// One measured piece of work, ours beside a baseline, as a row of the JSON. The work of a row: `landmarks` landmarks
/// of `kernel` with `support_mm`, over `points` points.
struct Row {
  std::string name;  ///< what was done; "case" in the JSON
  std::string kernel = "psi31";
  std::size_t points = 0, landmarks = 0;
  double support_mm = 12;
  int threads = 1;      ///< of ours; the baseline has one
  bool moving = false;  ///< landmark rest positions change every tick
  double ms = 0, baseline_ms = 0;
  std::map<std::string, double> more = {};  ///< further fields of the row; units in their names

  double ratio() const { return baseline_ms / ms; }
};

/// The measurements of one run. Rows in the order in which they were added.
struct Report {
  std::string simd_target, machine;
  double others_load = 0;                ///< share of the machine that others used meanwhile
  std::map<std::string, double> limits;  ///< of the machine
  std::map<std::string, double> memory;
  std::vector<std::string> benchmarks;  ///< that can be run, by name
  std::vector<Row> rows;

  /// The row of that work, or nothing: it was filtered out.
  const Row* find(std::string_view name, std::size_t points, std::size_t landmarks, int threads, bool moving,
                  std::string_view kernel = "psi31", double support_mm = 12) const;
  /// {"simd", "machine", "others_load", "limits", "memory", "rows", "goals"}. Throws UserError where `path` cannot
  /// be written.
  void write_json(const std::string& path) const;
};

/// A performance goal, beside its measurement.
struct Goal {
  std::string work;
  std::string figure;  ///< what is measured
  double measured = 0;
  bool at_least = true;  ///< else at most
  double target = 0;

  bool is_met() const { return at_least ? measured >= target : measured <= target; }
};

/// The goals whose rows were measured.
std::vector<Goal> goals(const Report& report);

/// The readable table, on stdout.
void print_goals(const Report& report);

}  // namespace brachy::bench
