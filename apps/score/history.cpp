#include "apps/score/history.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "apps/score/exercise.h"
#include "apps/score/spread.h"
#include "apps/session/session_manifest.h"
#include "core/base/error.h"

namespace brachy {
namespace {

using ReportJson = nlohmann::json;

struct Column {
  const char* name;
  double HistoryRow::*value;
  int digits;
};

constexpr std::array kColumns = {Column{"mean_error_mm", &HistoryRow::mean_error_mm, 2},
                                 Column{"axial_error_mm", &HistoryRow::axial_error_mm, 2},
                                 Column{"placed", &HistoryRow::placed, 0},
                                 Column{"missing", &HistoryRow::missing, 0},
                                 Column{"extra", &HistoryRow::extra, 0},
                                 Column{"time_s", &HistoryRow::time_s, 1},
                                 Column{"passes", &HistoryRow::passes, 0},
                                 Column{"organ_passes", &HistoryRow::organ_passes, 0},
                                 Column{"speed_p95_mm_s", &HistoryRow::speed_p95_mm_s, 1},
                                 Column{"v100_percent", &HistoryRow::v100_percent, 1},
                                 Column{"d90_gy", &HistoryRow::d90_gy, 1},
                                 Column{"urethra_d30_gy", &HistoryRow::urethra_d30_gy, 1},
                                 Column{"rectum_d2cc_gy", &HistoryRow::rectum_d2cc_gy, 1},
                                 Column{"findings", &HistoryRow::findings, 0}};

/// The number at a path of keys; kNoNumber where there is none.
double number_at(const ReportJson& json, std::initializer_list<const char*> keys) {
  const ReportJson* at = &json;
  for (const char* key : keys) {
    if (!at->is_object() || !at->contains(key)) return kNoNumber;
    at = &(*at)[key];
  }
  return at->is_number() ? at->get<double>() : at->is_array() ? static_cast<double>(at->size()) : kNoNumber;
}

double dose_at(const ReportJson& json, const char* structure, const char* figure) {
  if (!json.contains("dose") || !json["dose"].contains("rest") || !json["dose"]["rest"].is_object())
    return kNoNumber;
  for (const ReportJson& s : json["dose"]["rest"].value("structures", ReportJson::array()))
    if (s.value("name", "") == structure) return number_at(s, {figure});
  return kNoNumber;
}

HistoryRow row_of(const std::string& session, const ReportJson& json) {
  HistoryRow row;
  row.session = session;
  row.mean_error_mm = number_at(json, {"seeds", "by_position", "rest_error", "total_mm", "mean"});
  row.axial_error_mm = number_at(json, {"seeds", "by_position", "rest_error", "axial_mm", "mean"});
  row.placed = number_at(json, {"seeds", "by_position", "placed"});
  row.missing = number_at(json, {"seeds", "by_position", "missing"});
  row.extra = number_at(json, {"seeds", "by_position", "extra"});
  row.time_s = number_at(json, {"needles", "total", "elapsed_time_s"});
  row.passes = number_at(json, {"needles", "total", "passes"});
  row.speed_p95_mm_s = number_at(json, {"needles", "total", "speed_p95_mm_s"});
  row.organ_passes = 0;
  for (const ReportJson& contact : json.value("structures_entered", ReportJson::array()))
    row.organ_passes += number_at(contact, {"passes"});
  row.v100_percent = dose_at(json, "prostate", "v100_percent");
  row.d90_gy = dose_at(json, "prostate", "d90_gy");
  row.urethra_d30_gy = dose_at(json, "urethra", "d30_gy");
  row.rectum_d2cc_gy = dose_at(json, "rectum", "d2cc_gy");
  row.findings = number_at(json, {"findings"});
  return row;
}

/// A fraction of HDR: dwell positions for seeds, catheters for what is placed.
HistoryRow row_of_fraction(const std::string& session, const ReportJson& json) {
  HistoryRow row = row_of(session, json);
  double mean_mm = 0, along_mm = 0;
  row.placed = row.missing = 0;
  for (const ReportJson& catheter : json.value("catheters", ReportJson::array())) {
    const double mm = number_at(catheter, {"dwells_mean_mm"});
    ++(std::isfinite(mm) ? row.placed : row.missing);
    if (!std::isfinite(mm)) continue;
    mean_mm += mm;
    if (const auto error = catheter.find("tip_error_mm");
        error != catheter.end() && error->is_array() && error->size() == 3 && error->back().is_number())
      along_mm += std::abs(error->back().get<double>());
  }
  if (row.placed > 0) {
    row.mean_error_mm = mean_mm / row.placed;
    row.axial_error_mm = along_mm / row.placed;
  }
  row.extra = number_at(json, {"unplanned_needles"});
  const double gy_for_percent = number_at(json, {"prescription_gy"}) / 100;
  row.v100_percent = number_at(json, {"dose", "delivered", "prostate", "v100_percent", "value"});
  row.d90_gy = gy_for_percent * number_at(json, {"dose", "delivered", "prostate", "d90_percent", "value"});
  row.rectum_d2cc_gy =
      gy_for_percent * number_at(json, {"dose", "delivered", "rectum", "d2cc_percent", "value"});
  return row;
}

std::vector<double> known_of(const History& history, double HistoryRow::*value) {
  std::vector<double> known;
  for (const HistoryRow& row : history.rows)
    if (std::isfinite(row.*value)) known.push_back(row.*value);
  return known;
}

// Over the sessions' numbers 0, 1, …; those that are not known are left out.
double slope_of(const History& history, double HistoryRow::*value) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t i = 0; i < history.rows.size(); ++i) {
    const double v = history.rows[i].*value, at = static_cast<double>(i);
    if (!std::isfinite(v)) continue;
    n += 1;
    x += at;
    y += v;
    xx += at * at;
    xy += at * v;
  }
  const double spread = n * xx - x * x;
  return spread > 0 ? (n * xy - x * y) / spread : kNoNumber;
}

/// Numbers within names count as numbers: "2" before "10".
bool is_before(std::string_view a, std::string_view b) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  while (!a.empty() && !b.empty()) {
    if (!is_digit(a.front()) || !is_digit(b.front())) {
      if (a.front() != b.front()) return a.front() < b.front();
      a.remove_prefix(1);
      b.remove_prefix(1);
      continue;
    }
    const auto number = [&](std::string_view& text) {
      text.remove_prefix(std::min(text.find_first_not_of('0'), text.size()));
      const std::size_t count =
          static_cast<std::size_t>(std::ranges::find_if_not(text, is_digit) - text.begin());
      const std::string_view digits = text.substr(0, count);
      text.remove_prefix(count);
      return digits;
    };
    const std::string_view m = number(a), n = number(b);
    if (m.size() != n.size()) return m.size() < n.size();
    if (m != n) return m < n;
  }
  return a.size() < b.size();
}

/// From a session's manifest, where it has one.
void add_task(const SessionFolder& folder, HistoryRow& row) {
  const std::optional<SessionManifest> manifest = load_manifest(folder);
  if (!manifest) return;
  if (!manifest->runs.empty()) row.began = manifest->runs.front().began;
  if (manifest->exercise) row.task = exercise_name_in(manifest->exercise->text);
  if (row.task.empty())
    row.task = manifest->scene.file.empty() ? "the built-in phantom"
                                            : std::filesystem::path(manifest->scene.file).filename().string();
}

/// A cell of a CSV: with a comma or a quote it is quoted, as RFC 4180 has it.
std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted;
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return "\"" + quoted + "\"";
}

std::string figure_or(double value, int digits, const char* unknown) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : unknown;
}

}  // namespace

History load_history(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored))
    throw UserError(folder.string() + ": no such directory; give one that holds scored sessions");
  std::vector<std::filesystem::path> sessions;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
    if (entry.is_directory(ignored)) sessions.push_back(entry.path());
  History history;
  std::ranges::sort(sessions);
  for (const std::filesystem::path& session : sessions) {
    try {
      const SessionFolder files = SessionFolder::open(session);
      const bool is_fraction = files.has(kHdrReportFile);
      const char* file = is_fraction ? kHdrReportFile : kReportJson;
      const std::optional<std::string> text = files.read(file);
      if (!text) {
        history.remarks.push_back(session.string() + ": not scored; run `brachy score` on it");
        continue;
      }
      const ReportJson json = ReportJson::parse(*text, nullptr, false);
      if (!json.is_object()) {
        history.remarks.push_back(files.path_of(file).string() + ": is no report; run `brachy score` again");
        continue;
      }
      const std::string name = session.filename().string();
      HistoryRow row = is_fraction ? row_of_fraction(name, json) : row_of(name, json);
      add_task(files, row);
      history.rows.push_back(std::move(row));
    } catch (const UserError& e) {
      history.remarks.push_back(std::string(e.what()) + "; it was left out");
    }
  }
  std::ranges::stable_sort(history.rows, [](const HistoryRow& a, const HistoryRow& b) {
    if (a.task != b.task) return a.task < b.task;
    if (!a.began.empty() && !b.began.empty() && a.began != b.began) return a.began < b.began;
    if (a.began.empty() != b.began.empty()) return a.began.empty();
    return is_before(a.session, b.session);
  });
  if (history.rows.empty())
    throw UserError(folder.string() + ": holds no scored session; run `brachy score` on each first");
  return history;
}

std::vector<Trend> trends_of(const History& trainee, const History* instructor) {
  std::vector<Trend> trends;
  for (const Column& column : kColumns) {
    const std::vector<double> known = known_of(trainee, column.value);
    if (known.empty()) continue;
    trends.push_back({column.name, known.front(), known.back(), slope_of(trainee, column.value),
                      instructor ? spread_of(known_of(*instructor, column.value)).mean : kNoNumber});
  }
  return trends;
}

std::vector<History> by_task(const History& history) {
  std::vector<History> tasks;
  for (const HistoryRow& row : history.rows) {
    if (tasks.empty() || tasks.back().rows.back().task != row.task) tasks.emplace_back();
    tasks.back().rows.push_back(row);
  }
  return tasks;
}

std::string to_text(const History& trainee, const History* instructor) {
  std::vector<History> of_instructor;
  if (instructor) of_instructor = by_task(*instructor);
  std::string text;
  for (const History& task : by_task(trainee)) {
    const std::string& name = task.rows.front().task;
    const auto same =
        std::ranges::find(of_instructor, name, [](const History& h) { return h.rows.front().task; });
    text += fmt::format("{}{} sessions\n  {:<18}{:>10}{:>10}{:>14}{:>12}\n", name.empty() ? "" : name + ": ",
                        task.rows.size(), "", "first", "last", "per session", "instructor");
    for (const Trend& trend : trends_of(task, same == of_instructor.end() ? nullptr : &*same))
      text += fmt::format("  {:<18}{:>10}{:>10}{:>14}{:>12}\n", trend.name, figure_or(trend.first, 2, "–"),
                          figure_or(trend.last, 2, "–"),
                          std::isfinite(trend.per_session) ? fmt::format("{:+.3f}", trend.per_session) : "–",
                          figure_or(trend.instructor, 2, "–"));
  }
  return text;
}

std::string to_csv(const History& history) {
  std::string text = "session";
  for (const Column& column : kColumns) text += fmt::format(",{}", column.name);
  text += ",task,began\n";
  for (const HistoryRow& row : history.rows) {
    text += csv_cell(row.session);
    for (const Column& column : kColumns) text += "," + figure_or(row.*column.value, column.digits + 2, "");
    text += "," + csv_cell(row.task) + "," + row.began + "\n";
  }
  return text;
}

}  // namespace brachy
