#include "apps/lab/compare/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/lab/compare/row_report.h"

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson to_json(const CompareRow& row) {
  OrderedJson json = {{"model", row.model},   {"family", row.family},       {"scene", row.scene},
                      {"group", row.group},   {"counts", row.counts},       {"listed", row.listed},
                      {"kernel", row.kernel}, {"anchors", row.has_anchors}, {"surface", row.is_surface}};
  if (row.landmark_spacing_mm > 0) json["landmark_spacing_mm"] = row.landmark_spacing_mm;
  if (row.support_mm > 0) json["support_mm"] = row.support_mm;
  if (!row.error.empty()) {
    json["error"] = row.error;
    return json;
  }
  json["rel_l2"] = row.rel_l2;
  json["max_mm"] = row.max_mm;
  json["target_mm"] = row.target_mm;
  json["target_max_mm"] = row.target_max_mm;
  json["setup_ms"] = row.setup_ms;
  json["tick_ms"] = row.tick_ms;
  if (row.advance_ms > 0) json["advance_ms"] = row.advance_ms;
  json["ticks_to_rest"] = row.ticks_to_rest;
  json["bytes"] = row.bytes;
  json["min_det"] = row.min_det;
  return json;
}

/// A model's rows.
struct Means {
  std::vector<const CompareRow*> rows;

  template <class Value>
  std::vector<double> over(const std::string& group, Value value) const {
    std::vector<double> values;
    for (const CompareRow* row : rows)
      if (group.empty() ? row->counts : row->group == group) values.push_back(value(*row));
    return values;
  }
};

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

/// "–" where no scene of the group was run.
std::string cell(const std::vector<double>& values, const char* format, double factor = 1) {
  if (values.empty()) return "–";
  return fmt::format(fmt::runtime(format), factor * mean(values));
}

}  // namespace

std::string to_json(const std::vector<CompareRow>& rows, bool quick) {
  OrderedJson all = OrderedJson::array();
  for (const CompareRow& row : rows) all.push_back(to_json(row));
  return report_text(quick, std::move(all));
}

std::string to_markdown(const std::vector<CompareRow>& rows) {
  std::vector<std::string> order;
  for (const CompareRow& row : rows)
    if (row.listed && row.error.empty()) add_name(order, row.model);

  std::string text =
      "| model | homogeneous, % | stiff gland, % | free face, % | neo-Hookean, % | worst point, mm | "
      "targets, mm | tick, ms | tip advancing, ms | ticks to rest | set-up, ms | memory, MB | least det |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const std::string& model : order) {
    Means means;
    for (const CompareRow& row : rows)
      if (row.model == model && row.error.empty()) means.rows.push_back(&row);
    const auto rel_l2 = [](const CompareRow& row) { return row.rel_l2; };
    text += "| " + model;
    for (const char* group : {"homogeneous", "stiff", "free_face", "neo_hookean"})
      text += " | " + cell(means.over(group, rel_l2), "{:.1f}", 100);
    text += " | " + cell(means.over("", [](const CompareRow& row) { return row.max_mm; }), "{:.2f}");
    text += " | " + cell(means.over("", [](const CompareRow& row) { return row.target_mm; }), "{:.2f}");
    text += " | " + cell(means.over("", [](const CompareRow& row) { return row.tick_ms; }), "{:.3g}");
    const auto advance = means.over("", [](const CompareRow& row) { return row.advance_ms; });
    text += " | " + (advance.empty() || mean(advance) > 0 ? cell(advance, "{:.3g}") : "set-up");
    text += " | " +
            cell(means.over("", [](const CompareRow& row) { return double(row.ticks_to_rest); }), "{:.0f}");
    text += " | " + cell(means.over("", [](const CompareRow& row) { return row.setup_ms; }), "{:.0f}");
    text +=
        " | " + cell(means.over("", [](const CompareRow& row) { return double(row.bytes); }), "{:.1f}", 1e-6);
    const auto dets = means.over("", [](const CompareRow& row) { return row.min_det; });
    text += " | " + (dets.empty() ? "–" : fmt::format("{:.2f}", std::ranges::min(dets))) + " |\n";
  }
  return text;
}

}  // namespace brachy
