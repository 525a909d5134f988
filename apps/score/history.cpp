#include "apps/score/history.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
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

std::vector<double> values_of(const History& history, double HistoryRow::*value) {
  std::vector<double> values;
  for (const HistoryRow& row : history.rows) values.push_back(row.*value);
  return values;
}

std::vector<double> known_of(const History& history, double HistoryRow::*value) {
  std::vector<double> known = values_of(history, value);
  std::erase_if(known, [](double v) { return !std::isfinite(v); });
  return known;
}

/// Whether it is passed, by which bounds, and what went wrong first, as reports of implants and fractions say it.
void add_texts(const ReportJson& json, HistoryRow& row) {
  const auto texts_of = [&](const ReportJson& list) {
    std::vector<std::string> texts;
    for (const ReportJson& one : list)
      if (one.is_object() && one.contains("text") && one["text"].is_string()) texts.push_back(one["text"]);
    return texts;
  };
  if (json.contains("findings")) row.first_findings = texts_of(json["findings"]);
  if (row.first_findings.size() > kHistoryFindings) row.first_findings.resize(kHistoryFindings);
  const auto exercise = json.find("exercise");
  if (exercise == json.end() || !exercise->is_object()) return;
  if (const auto passed = exercise->find("passed"); passed != exercise->end() && passed->is_boolean())
    row.has_passed = passed->get<bool>();
  if (exercise->contains("lines")) row.bounds = texts_of((*exercise)["lines"]);
  if (const auto name = exercise->find("name"); name != exercise->end() && name->is_string())
    row.task = *name;
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
  if (!manifest->trainee.empty()) row.trainee = manifest->trainee;
  if (manifest->exercise) row.task = exercise_name_in(manifest->exercise->text);
  if (row.task.empty())
    row.task = manifest->scene.file.empty() ? "the built-in phantom"
                                            : std::filesystem::path(manifest->scene.file).filename().string();
}

/// Adds the session's row, or a remark why there is none.
void add_session(const std::filesystem::path& session, const std::string& trainee, History& history) {
  try {
    const SessionFolder files = SessionFolder::open(session);
    const bool is_fraction = files.has(kHdrReportFile);
    const char* file = is_fraction ? kHdrReportFile : kReportJson;
    const std::optional<std::string> text = files.read(file);
    if (!text) {
      history.remarks.push_back(session.string() + ": not scored; run `brachy score` on it");
      return;
    }
    const ReportJson json = ReportJson::parse(*text, nullptr, false);
    if (!json.is_object()) {
      history.remarks.push_back(files.path_of(file).string() + ": is no report; run `brachy score` again");
      return;
    }
    const std::string name = session.filename().string();
    HistoryRow row = is_fraction ? row_of_fraction(name, json) : row_of(name, json);
    row.folder = session;
    row.trainee = trainee;
    add_texts(json, row);
    add_task(files, row);
    history.rows.push_back(std::move(row));
  } catch (const UserError& e) {
    history.remarks.push_back(std::string(e.what()) + "; it was left out");
  }
}

/// In the order of their names. Throws UserError.
std::vector<std::filesystem::path> folders_in(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored))
    throw UserError(folder.string() + ": no such directory; give one that holds scored sessions");
  std::vector<std::filesystem::path> folders;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
    if (entry.is_directory(ignored)) folders.push_back(entry.path());
  std::ranges::sort(folders);
  return folders;
}

void sort_sessions(const std::filesystem::path& folder, History& history) {
  std::ranges::stable_sort(history.rows, [](const HistoryRow& a, const HistoryRow& b) {
    if (a.trainee != b.trainee) return a.trainee < b.trainee;
    if (a.task != b.task) return a.task < b.task;
    if (!a.began.empty() && !b.began.empty() && a.began != b.began) return a.began < b.began;
    if (a.began.empty() != b.began.empty()) return a.began.empty();
    return is_before(a.session, b.session);
  });
  if (history.rows.empty())
    throw UserError(folder.string() + ": holds no scored session; run `brachy score` on each first");
}

bool is_session(const std::filesystem::path& folder) {
  return std::ranges::any_of(std::array{kManifestFile, kReportJson, kHdrReportFile, kPosesFile, kSeedsFile},
                             [&](const char* file) {
                               std::error_code ignored;
                               return std::filesystem::exists(folder / file, ignored);
                             });
}

/// Of each trainee of `cohort` but `trainee` the last session of a task.
History last_of_others(const History& cohort, const std::string& trainee, const std::string& task) {
  History last;
  for (const HistoryRow& row : cohort.rows) {
    if (row.task != task || row.trainee == trainee) continue;
    if (!last.rows.empty() && last.rows.back().trainee == row.trainee)
      last.rows.back() = row;
    else
      last.rows.push_back(row);
  }
  return last;
}

/// Of anybody.
History of_task(const History& all, const std::string& task) {
  History same;
  std::ranges::copy_if(all.rows, std::back_inserter(same.rows),
                       [&](const HistoryRow& row) { return row.task == task; });
  return same;
}

std::string quartiles_text(const Quartiles& q) {
  return q.count == 0   ? "–"
         : q.count == 1 ? fmt::format("{:.2f}", q.median)
                        : fmt::format("{:.2f} ({:.2f}–{:.2f})", q.median, q.first, q.third);
}

std::string curve_text(const std::optional<LearningCurve>& curve) {
  return curve ? fmt::format("{:.2f} after {:.1f} sessions (R² {:.2f})", curve->plateau, curve->sessions,
                             curve->r_squared)
               : "–";
}

std::string passed_text(const HistoryRow& row) {
  return !row.has_passed ? "" : *row.has_passed ? "passed" : "not passed";
}

}  // namespace

std::string figure_or(double value, int digits, const char* unknown) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : unknown;
}

std::string yes_or_no(const std::optional<bool>& value) {
  return !value ? "" : *value ? "yes" : "no";
}

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted;
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return "\"" + quoted + "\"";
}

Quartiles quartiles_of(std::vector<double> values) {
  std::ranges::sort(values);
  const auto at = [&](double share) {
    if (values.empty()) return kNoNumber;
    const double place = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
  };
  return {values.size(), at(0.25), at(0.5), at(0.75)};
}

History load_history(const std::filesystem::path& folder) {
  History history;
  const std::string trainee = std::filesystem::absolute(folder / ".").parent_path().filename().string();
  for (const std::filesystem::path& session : folders_in(folder)) add_session(session, trainee, history);
  sort_sessions(folder, history);
  return history;
}

std::vector<std::filesystem::path> session_folders(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> sessions;
  for (const std::filesystem::path& one : folders_in(folder)) {
    if (is_session(one))
      sessions.push_back(one);
    else
      std::ranges::copy_if(folders_in(one), std::back_inserter(sessions), is_session);
  }
  return sessions;
}

History load_class(const std::filesystem::path& folder) {
  History history;
  for (const std::filesystem::path& one : folders_in(folder)) {
    if (is_session(one))
      add_session(one, "", history);
    else
      for (const std::filesystem::path& session : folders_in(one))
        add_session(session, one.filename().string(), history);
  }
  sort_sessions(folder, history);
  return history;
}

std::vector<Trend> trends_of(const History& trainee, const Peers& peers) {
  const HistoryRow& any = trainee.rows.front();
  const History instructor = peers.instructor ? of_task(*peers.instructor, any.task) : History();
  const History cohort = peers.cohort ? last_of_others(*peers.cohort, any.trainee, any.task) : History();
  std::vector<Trend> trends;
  for (const Column& column : kColumns) {
    const std::vector<double> known = known_of(trainee, column.value);
    if (known.empty()) continue;
    const std::vector<double> values = values_of(trainee, column.value);
    trends.push_back({column.name, known.front(), known.back(), slope_per_session(values),
                      learning_curve(values), quartiles_of(known_of(instructor, column.value)),
                      quartiles_of(known_of(cohort, column.value))});
  }
  return trends;
}

std::vector<History> by_task(const History& history) {
  std::vector<History> tasks;
  for (const HistoryRow& row : history.rows) {
    if (tasks.empty() || tasks.back().rows.back().task != row.task ||
        tasks.back().rows.back().trainee != row.trainee)
      tasks.emplace_back();
    tasks.back().rows.push_back(row);
  }
  return tasks;
}

std::string to_text(const History& trainee, const Peers& peers) {
  std::string text;
  for (const History& task : by_task(trainee)) {
    const HistoryRow& any = task.rows.front();
    text += fmt::format("{}{}{} session{}\n", any.trainee.empty() ? "" : any.trainee + ", ",
                        any.task.empty() ? "" : any.task + ": ", task.rows.size(),
                        task.rows.size() == 1 ? "" : "s");
    for (const HistoryRow& row : task.rows)
      if (row.has_passed) text += fmt::format("  {:<18}{:<22}{}\n", row.session, row.began, passed_text(row));
    text += fmt::format("  {:<18}{:>10}{:>10}{:>14}  {:<24}{:<24}{}\n", "", "first", "last", "per session",
                        "instructor", "cohort", "learning curve");
    for (const Trend& trend : trends_of(task, peers))
      text += fmt::format("  {:<18}{:>10}{:>10}{:>14}  {:<24}{:<24}{}\n", trend.name,
                          figure_or(trend.first, 2, "–"), figure_or(trend.last, 2, "–"),
                          std::isfinite(trend.per_session) ? fmt::format("{:+.3f}", trend.per_session) : "–",
                          quartiles_text(trend.instructor), quartiles_text(trend.cohort),
                          curve_text(trend.curve));
  }
  return text;
}

std::string to_csv(const History& history) {
  std::string text = "session";
  for (const Column& column : kColumns) text += fmt::format(",{}", column.name);
  text += ",task,began,passed,trainee\n";
  for (const HistoryRow& row : history.rows) {
    text += csv_cell(row.session);
    for (const Column& column : kColumns) text += "," + figure_or(row.*column.value, column.digits + 2, "");
    text += fmt::format(",{},{},{},{}\n", csv_cell(row.task), row.began, yes_or_no(row.has_passed),
                        csv_cell(row.trainee));
  }
  return text;
}

}  // namespace brachy
