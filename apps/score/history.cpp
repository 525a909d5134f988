#include "apps/score/history.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "apps/score/spread.h"
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
  std::ranges::sort(sessions);
  History history;
  for (const std::filesystem::path& session : sessions) {
    const std::filesystem::path file = session / "report.json";
    if (!std::filesystem::is_regular_file(file, ignored)) {
      history.remarks.push_back(session.string() + ": not scored; run `brachy score` on it");
      continue;
    }
    std::ifstream in(file, std::ios::binary);
    const ReportJson json = ReportJson::parse(in, nullptr, false);
    if (!json.is_object())
      history.remarks.push_back(file.string() + ": is no report; run `brachy score` again");
    else
      history.rows.push_back(row_of(session.filename().string(), json));
  }
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

std::string to_text(const History& trainee, const History* instructor) {
  std::string text = fmt::format("{} sessions\n  {:<18}{:>10}{:>10}{:>14}{:>12}\n", trainee.rows.size(), "",
                                 "first", "last", "per session", "instructor");
  for (const Trend& trend : trends_of(trainee, instructor))
    text += fmt::format("  {:<18}{:>10}{:>10}{:>14}{:>12}\n", trend.name, figure_or(trend.first, 2, "–"),
                        figure_or(trend.last, 2, "–"),
                        std::isfinite(trend.per_session) ? fmt::format("{:+.3f}", trend.per_session) : "–",
                        figure_or(trend.instructor, 2, "–"));
  return text;
}

std::string to_csv(const History& history) {
  std::string text = "session";
  for (const Column& column : kColumns) text += fmt::format(",{}", column.name);
  text += "\n";
  for (const HistoryRow& row : history.rows) {
    // A name with a comma or a quote is quoted, as RFC 4180 has it.
    std::string name;
    for (const char c : row.session) name += c == '"' ? std::string("\"\"") : std::string(1, c);
    text += row.session.find_first_of(",\"\n\r") == std::string::npos ? row.session : "\"" + name + "\"";
    for (const Column& column : kColumns) text += "," + figure_or(row.*column.value, column.digits + 2, "");
    text += "\n";
  }
  return text;
}

}  // namespace brachy
