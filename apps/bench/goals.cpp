// The performance goals: for each, the figure of a run's rows that measures it, and its target.
#include <algorithm>
#include <cmath>

#include "apps/bench/report.h"

namespace brachy::bench {
namespace {

constexpr bool kAtLeast = true, kAtMost = false;

/// The rows whose name is `name`, or begins with it and a slash.
std::vector<const Row*> rows_called(const Report& report, const std::string& name) {
  std::vector<const Row*> found;
  for (const Row& row : report.rows)
    if (row.name == name || row.name.starts_with(name + "/")) found.push_back(&row);
  return found;
}

/// Least-squares slope of log time over log points.
double log_log_slope(const std::vector<const Row*>& rows) {
  double x = 0, y = 0, xx = 0, xy = 0;
  const auto n = static_cast<double>(rows.size());
  for (const Row* row : rows) {
    const double log_points = std::log(row->more.at("points_inside")), log_ms = std::log(row->ms);
    x += log_points;
    y += log_ms;
    xx += log_points * log_points;
    xy += log_points * log_ms;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

}  // namespace

std::vector<Goal> goals(const Report& report) {
  constexpr std::size_t kPaper = 14560, kMillion = 1'000'000;
  std::vector<Goal> goals;
  const auto add_speed_up = [&](const std::string& work, const Row* row, double target) {
    if (row) goals.push_back({work, "times the baseline", row->ratio(), kAtLeast, target});
  };
  const auto add_ticks = [&](bool moving, std::size_t n, double target) {
    add_speed_up(
        (moving ? "moving, all rebuilt, 14,560 points, n = " : "fixed, 4 moving, 14,560 points, n = ") +
            std::to_string(n),
        report.find("tick", kPaper, n, 1, moving), target);
  };
  add_ticks(true, 10, 15);
  add_ticks(true, 30, 20);
  add_ticks(true, 100, 17);
  add_ticks(false, 10, 70);
  add_ticks(false, 30, 200);
  add_ticks(false, 100, 600);
  add_speed_up("moving, 1M points, n = 100, 2 threads", report.find("tick", kMillion, 100, 2, true), 60);
  add_speed_up("fixed, 1M points, n = 100, 2 threads", report.find("tick", kMillion, 100, 2, false), 300);

  for (const std::size_t points : {kPaper, kMillion}) {
    const std::string where = points == kPaper ? "14,560 points" : "1M points";
    const Row* psi31 = report.find("direct", points, 100, 1, true);
    const Row* buhmann = report.find("direct", points, 100, 1, true, "buhmann");
    if (buhmann)
      goals.push_back({"Buhmann direct, n = 100, " + where, "times psi31's time",
                       buhmann->ms / buhmann->more.at("psi31_ms"), kAtMost, 3});
    if (psi31)
      goals.push_back(
          {"direct, n = 100, " + where, "share of FMA peak", psi31->more.at("fma_share"), kAtLeast, 0.35});
  }
  if (const auto rows = rows_called(report, "inside"); rows.size() >= 2)
    goals.push_back({"rebuilt tick, n = 10, 1e3 to 1e6 points inside supports", "log-log slope",
                     log_log_slope(rows), kAtMost, 1.1});
  // Without any points around them, no block straddles the supports' border: the first row is no measure of growth.
  if (const auto rows = rows_called(report, "outside"); rows.size() == 3)
    goals.push_back({"rebuilt tick, n = 10, 1e4 points inside, 1e5 to 1e6 outside", "growth of time",
                     rows[2]->ms / rows[1]->ms, kAtMost, 1.1});

  if (const auto rows = rows_called(report, "tick"); !rows.empty()) {
    double largest = 0;
    for (const Row* row : rows) largest = std::max(largest, row->more.at("difference_mm"));
    goals.push_back({"every tick timed, ours against the baseline's field", "largest difference, mm", largest,
                     kAtMost, 2e-5});
  }

  const auto about = [](const Row* row) { return row->name + ", n = " + std::to_string(row->landmarks); };
  for (const char* change : {"append", "remove"})
    for (const Row* row : rows_called(report, change))
      goals.push_back({"one landmark, " + about(row), "share of refactorising", row->ms / row->baseline_ms,
                       kAtMost, 0.1});
  for (const Row* row : rows_called(report, "sparse")) {
    goals.push_back({"factor, a = 4 spacings, " + about(row), "times ours dense", row->ratio(), kAtLeast, 5});
    goals.push_back({"factor, a = 4 spacings, " + about(row), "times the paper's dense",
                     row->more.at("paper_ms") / row->ms, kAtLeast, 5});
    goals.push_back(
        {"solution, " + about(row), "largest difference, mm", row->more.at("difference_mm"), kAtMost, 1e-9});
  }
  for (const Row* row : rows_called(report, "dose/seed"))
    goals.push_back({"dose: a seed on 1 mm over 60 mm", "ms", row->ms, kAtMost, 3});
  for (const Row* row : rows_called(report, "dose/evaluate"))
    goals.push_back({"dose: DVH of all structures, 1 mm", "ms", row->ms, kAtMost, 5});
  for (const Row* row : rows_called(report, "dose/spacing")) {
    if (row->more.at("spacing_mm") != 1) continue;
    for (const char* figure : {"v100_error_percent", "d90_error_percent"})
      goals.push_back({"dose: 100 seeds, 1 mm, against exact sums at random points", figure,
                       std::abs(row->more.at(figure)), kAtMost, 1});
  }
  return goals;
}

}  // namespace brachy::bench
