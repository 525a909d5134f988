#include "apps/score/class_table.h"

#include <fmt/format.h>

#include <algorithm>

namespace brachy {
namespace {

/// The figures that the table follows.
constexpr const char* kFollowed[] = {"mean_error_mm", "v100_percent", "d90_gy"};

}  // namespace

const HistoryRow* TraineeTask::first_passed() const {
  const auto found = std::ranges::find_if(
      sessions.rows, [](const HistoryRow& row) { return row.has_passed.value_or(false); });
  return found == sessions.rows.end() ? nullptr : &*found;
}

std::vector<TraineeTask> class_table(const History& sessions) {
  std::vector<TraineeTask> table;
  for (History& task : by_task(sessions)) {
    const auto passed = std::ranges::count_if(
        task.rows, [](const HistoryRow& row) { return row.has_passed.value_or(false); });
    table.push_back({std::move(task), static_cast<std::size_t>(passed)});
  }
  return table;
}

std::string to_text(const std::vector<TraineeTask>& table) {
  std::string text = fmt::format("{:<20}{:<34}{:>9}{:>8}  {:<22}{}\n", "trainee", "task", "sessions",
                                 "passed", "first passed", "what went wrong last");
  for (const TraineeTask& t : table) {
    const HistoryRow* first = t.first_passed();
    text += fmt::format("{:<20}{:<34}{:>9}{:>8}  {:<22}{}\n", t.trainee(), t.task(), t.sessions.rows.size(),
                        t.last().has_passed || first ? std::to_string(t.passed) : "–",
                        !first                 ? "–"
                        : first->began.empty() ? first->session
                                               : first->began,
                        t.last().first_findings.empty() ? "" : t.last().first_findings.front());
  }
  return text;
}

std::string to_csv(const std::vector<TraineeTask>& table) {
  std::string text =
      "trainee,task,sessions,passed,first_passed_session,first_passed_began,last_session,last_began,last_"
      "passed";
  for (const char* name : kFollowed) text += fmt::format(",{0},{0}_per_session", name);
  text += ",last_finding\n";
  for (const TraineeTask& t : table) {
    const HistoryRow* first = t.first_passed();
    text += fmt::format("{},{},{},{},{},{},{},{},{}", csv_cell(t.trainee()), csv_cell(t.task()),
                        t.sessions.rows.size(), t.passed, first ? csv_cell(first->session) : "",
                        first ? first->began : "", csv_cell(t.last().session), t.last().began,
                        yes_or_no(t.last().has_passed));
    const std::vector<Trend> trends = trends_of(t.sessions, {});
    for (const char* name : kFollowed) {
      const auto trend = std::ranges::find(trends, name, &Trend::name);
      text += trend == trends.end() ? ",,"
                                    : fmt::format(",{},{}", figure_or(trend->last, 2, ""),
                                                  figure_or(trend->per_session, 2, ""));
    }
    text += "," + csv_cell(t.last().first_findings.empty() ? "" : t.last().first_findings.front()) + "\n";
  }
  return text;
}

}  // namespace brachy
