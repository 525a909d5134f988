#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/lab/compare/row_report.h"
#include "apps/lab/ticks/tick_errors.h"

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson to_json(const TickRow& row) {
  OrderedJson json = {{"model", row.model},
                      {"in_daemon", row.is_in_daemon},
                      {"scene", row.scene},
                      {"motion_mm", row.motion_mm}};
  if (!row.error.empty()) {
    json["error"] = row.error;
    return json;
  }
  json["rel_l2"] = row.rel_l2;
  json["max_mm"] = row.max_mm;
  if (row.evaluation_ms > 0) json["evaluation_ms"] = row.evaluation_ms;
  if (!row.is_in_daemon) return json;
  json["kernel"] = row.kernel;
  if (row.support_mm > 0) json["support_mm"] = row.support_mm;
  json["anchors"] = row.has_anchors;
  json["surface"] = row.is_surface;
  if (row.landmark_spacing_mm > 0) json["landmark_spacing_mm"] = row.landmark_spacing_mm;
  json["missed_mm"] = row.missed_mm;
  json["verdict"] = row.verdict;
  json["vertex_det"] = row.vertex_det;
  json["held_mm"] = row.held_mm;
  json["substeps"] = row.substeps;
  json["late"] = row.is_late;
  return json;
}

template <class Member>
std::vector<std::string> names(const std::vector<TickRow>& rows, Member member) {
  std::vector<std::string> all;
  for (const TickRow& row : rows) add_name(all, row.*member);
  return all;
}

}  // namespace

std::string to_json(const std::vector<TickRow>& rows, bool quick) {
  OrderedJson all = OrderedJson::array();
  for (const TickRow& row : rows) all.push_back(to_json(row));
  return report_text(quick, std::move(all));
}

std::string to_markdown(const std::vector<TickRow>& rows) {
  const std::vector<std::string> scenes = names(rows, &TickRow::scene);
  std::string text = "| relative L2, % |", line = "|---|";
  for (const std::string& scene : scenes) {
    text += " " + scene + " |";
    line += "---|";
  }
  text += "\n" + line + "\n";
  for (const std::string& model : names(rows, &TickRow::model)) {
    text += "| " + model;
    for (const std::string& scene : scenes) {
      std::string cell;
      for (const TickRow& row : rows)
        if (row.model == model && row.scene == scene)
          cell += (cell.empty() ? "" : ", ") +
                  (row.error.empty() ? fmt::format("{:.1f}", 100 * row.rel_l2) : std::string("–"));
      text += " | " + (cell.empty() ? "–" : cell);
    }
    text += " |\n";
  }
  return text;
}

}  // namespace brachy
