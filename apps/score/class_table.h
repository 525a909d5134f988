#pragma once

#include <string>
#include <vector>

#include "apps/score/history.h"

namespace brachy {

/// A trainee's sessions of one task, in their order.
struct TraineeTask {
  History sessions;  ///< at least one
  std::size_t passed = 0;
  const HistoryRow* first_passed() const;  ///< null: not passed yet, or the task is no exercise

  const std::string& trainee() const { return sessions.rows.front().trainee; }
  const std::string& task() const { return sessions.rows.front().task; }
  const HistoryRow& last() const { return sessions.rows.back(); }
};

/// A class by trainee and task.
std::vector<TraineeTask> class_table(const History& sessions);

/// For a terminal: a line for each trainee and task.
std::string to_text(const std::vector<TraineeTask>& table);
/// A header and a row for each trainee and task; what is not known is empty.
std::string to_csv(const std::vector<TraineeTask>& table);

/// A page that needs no other file, and prints on A4: trainees by exercises, and of each trainee, on a sheet of its
/// own, a record of completion with what was passed and when, and the learning curves against the class's others.
/// `only`: that trainee's sheet alone; empty: all. `version`: of this program. Throws UserError where there is no such
/// trainee.
std::string to_html(const History& sessions, const std::string& only, const std::string& version);

}  // namespace brachy
