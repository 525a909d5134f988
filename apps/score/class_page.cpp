#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "apps/charts/svg_chart.h"
#include "apps/score/class_table.h"
#include "apps/score/report.h"
#include "apps/score/report_figures.h"
#include "apps/score/report_page.h"
#include "core/base/error.h"

namespace brachy {
namespace {

std::string name_or_none(const std::string& name) {
  return name.empty() ? "not named" : name;
}

/// "; error 1.2 mm, −0.31 a session": of the last session and the course to it; empty: there is no course.
std::string trend_text(const TraineeTask& t) {
  const std::vector<Trend> trends = trends_of(t.sessions, {});
  const auto error = std::ranges::find(trends, "mean_error_mm", &Trend::name);
  if (error == trends.end() || !std::isfinite(error->per_session)) return "";
  return fmt::format("; error {:.1f} mm, {:+.2f} a session", error->last, error->per_session);
}

/// "passed 2026-11-03 (2 of 3); error 1.2 mm, −0.31 a session" in the table of a class.
std::string class_cell(const TraineeTask& t) {
  if (const HistoryRow* first = t.first_passed())
    return html_cell(fmt::format("passed {} ({} of {})",
                                 first->began.empty() ? first->session : first->began.substr(0, 10), t.passed,
                                 t.sessions.rows.size()) +
                     trend_text(t));
  const std::string tried =
      fmt::format("{} session{}", t.sessions.rows.size(), t.sessions.rows.size() == 1 ? "" : "s");
  return t.last().has_passed ? html_cell("not passed, " + tried + trend_text(t), " class=\"missed\"")
                             : html_cell(tried + trend_text(t));
}

std::string class_section(const std::vector<TraineeTask>& table) {
  std::set<std::string> tasks;
  std::map<std::string, std::map<std::string, const TraineeTask*>> trainees;
  for (const TraineeTask& t : table) {
    tasks.insert(t.task());
    trainees[t.trainee()][t.task()] = &t;
  }
  std::vector<std::string> headings = {""};
  for (const std::string& task : tasks) headings.push_back(xml_escaped(name_or_none(task)));
  headings.emplace_back("what went wrong last");
  std::string rows;
  for (const auto& [name, own] : trainees) {
    rows += "<tr>" + html_cell(name_or_none(name));
    const HistoryRow* last = nullptr;
    for (const std::string& task : tasks) {
      const auto found = own.find(task);
      rows += found == own.end() ? html_cell("–") : class_cell(*found->second);
      if (found == own.end()) continue;
      const HistoryRow& row = found->second->last();
      if (!last || row.began > last->began) last = &row;
    }
    rows += html_cell(last && !last->first_findings.empty() ? last->first_findings.front() : "",
                      " class=\"left\"") +
            "</tr>\n";
  }
  return "<h1>Class</h1>\n<p class=\"about\">" + std::string(kNotice) + "</p>\n" +
         html_table(" class=\"long worded\"", headings, rows);
}

Chart curve_chart(const TraineeTask& t, const Trend& trend, const char* label, double HistoryRow::*value) {
  Chart chart{
      .title = label, .x_label = "session", .y_label = label, .lines = {}, .width_px = 430, .height_px = 230};
  ChartLine own{.name = "sessions", .colour = "#0072b2", .width_px = 1, .dot_px = 3};
  ChartLine fit{.name = "learning curve", .colour = "#0072b2", .dashes = "6 3"};
  const std::size_t count = t.sessions.rows.size();
  for (std::size_t i = 0; i < count; ++i) {
    own.x.push_back(static_cast<double>(i + 1));
    own.y.push_back(t.sessions.rows[i].*value);
    if (!trend.curve) continue;
    fit.x.push_back(own.x.back());
    fit.y.push_back(trend.curve->at(static_cast<double>(i)));
  }
  chart.lines.push_back(std::move(own));
  if (trend.curve) chart.lines.push_back(std::move(fit));
  if (trend.cohort.count == 0) return chart;
  for (const auto& [name, y, dashes] : {std::tuple{"others: median", trend.cohort.median, ""},
                                        std::tuple{"others: quartiles", trend.cohort.first, "2 3"},
                                        std::tuple{"", trend.cohort.third, "2 3"}})
    chart.lines.push_back({.name = name,
                           .colour = "#888888",
                           .dashes = dashes,
                           .x = {1, static_cast<double>(std::max<std::size_t>(count, 2))},
                           .y = {y, y}});
  return chart;
}

std::string curves(const TraineeTask& t, const History& all) {
  struct Followed {
    const char *name, *label;
    double HistoryRow::*value;
  };
  const std::vector<Trend> trends = trends_of(t.sessions, {.cohort = &all});
  std::string charts, text;
  for (const Followed& f : {Followed{"mean_error_mm", "mean error, mm", &HistoryRow::mean_error_mm},
                            Followed{"v100_percent", "prostate V100, %", &HistoryRow::v100_percent}}) {
    const auto trend = std::ranges::find(trends, f.name, &Trend::name);
    if (trend == trends.end()) continue;
    charts += to_svg_element(curve_chart(t, *trend, f.label, f.value));
    if (trend->curve)
      text += fmt::format(
          "<p class=\"small\">{}: towards {:.2f}, 63 % of the way after {:.1f} sessions (R² {:.2f}).</p>\n",
          f.label, trend->curve->plateau, trend->curve->sessions, trend->curve->r_squared);
    else if (std::isfinite(trend->per_session))
      text += fmt::format("<p class=\"small\">{}: {:+.2f} a session.</p>\n", f.label, trend->per_session);
  }
  return charts.empty() ? "" : "<div class=\"pair\">\n" + charts + "</div>\n" + text;
}

/// A trainee's sheet.
std::string record_section(const std::string& name, const std::vector<TraineeTask>& table, const History& all,
                           const std::string& version) {
  std::string rows, charts;
  std::size_t passed = 0, exercises = 0;
  for (const TraineeTask& t : table) {
    if (t.trainee() != name) continue;
    charts += "<h2>" + xml_escaped(name_or_none(t.task())) + "</h2>\n" + curves(t, all);
    const HistoryRow* first = t.first_passed();
    if (!first && !t.last().has_passed) continue;
    ++exercises;
    passed += first ? 1 : 0;
    const HistoryRow& shown = first ? *first : t.last();
    std::string bounds;
    for (const std::string& bound : shown.bounds) bounds += (bounds.empty() ? "" : "; ") + bound;
    rows += "<tr>" + html_cell(t.task()) +
            html_cell(first ? "passed" : "not passed", first ? "" : " class=\"missed\"") +
            html_cell(shown.began.empty() ? "–" : shown.began) + html_cell(shown.session) +
            html_cell(std::to_string(t.sessions.rows.size())) + html_cell(bounds, " class=\"left\"") +
            "</tr>\n";
  }
  std::string out =
      fmt::format("<h1 class=\"next\">Record of completion: {}</h1>\n<p class=\"about\">{}</p>\n",
                  xml_escaped(name_or_none(name)), kNotice);
  out += exercises == 0
             ? "<p>No session of an exercise whose report says whether it is passed.</p>\n"
             : fmt::format("<p>Passed {} of the {} exercise{} tried.</p>\n", passed, exercises,
                           exercises == 1 ? "" : "s") +
                   html_table(" class=\"long worded\"",
                              {"exercise", "", "session begun, UTC", "session", "sessions", "by its bounds"},
                              rows);
  return out +
         fmt::format(
             "<p class=\"small\">As the sessions&rsquo; reports say, read by brachy {}. Times are those of "
             "the computers on which the sessions ran.</p>\n",
             xml_escaped(version)) +
         charts;
}

}  // namespace

std::string to_html(const History& sessions, const std::string& only, const std::string& version) {
  const std::vector<TraineeTask> table = class_table(sessions);
  std::vector<std::string> names;
  for (const TraineeTask& t : table)
    if (names.empty() || names.back() != t.trainee()) names.push_back(t.trainee());
  if (!only.empty()) {
    if (std::ranges::find(names, only) == names.end()) {
      std::string known;
      for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name_or_none(name);
      throw UserError("no session of trainee \"" + only + "\"; there are those of " + known);
    }
    names = {only};
  }
  std::string out = page_start(only.empty() ? "Class" : "Record of completion: " + only);
  if (only.empty()) out += class_section(table);
  for (const std::string& name : names) out += record_section(name, table, sessions, version);
  return out + "</body>\n</html>\n";
}

}  // namespace brachy
