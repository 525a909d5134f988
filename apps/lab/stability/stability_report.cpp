#include "apps/lab/stability/stability_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// JSON has no infinity: null.
OrderedJson number(double value) {
  return std::isfinite(value) ? OrderedJson(value) : OrderedJson(nullptr);
}

OrderedJson number(const std::optional<double>& value) {
  return value ? number(*value) : OrderedJson(nullptr);
}

OrderedJson numbers(const std::vector<double>& values) {
  OrderedJson array = OrderedJson::array();
  for (const double value : values) array.push_back(number(value));
  return array;
}

OrderedJson to_json(const StabilityRow& row) {
  OrderedJson json = {{"method", row.method},
                      {"sweep", row.sweep},
                      {"parameter", row.parameter},
                      {"at_failure", number(row.at_failure)},
                      {"swept_to", row.kind == "law" ? OrderedJson(nullptr) : number(row.swept_to)},
                      {"theory", number(row.theory)},
                      {"kind", row.kind}};
  if (row.theory_range) json["theory_range"] = {(*row.theory_range)[0], (*row.theory_range)[1]};
  return json;
}

OrderedJson to_json(const StabilityCurve& curve) {
  OrderedJson json = {{"method", curve.method},
                      {"sweep", curve.sweep},
                      {"parameter", curve.parameter},
                      {"at", numbers(curve.at)}};
  if (!curve.condition.empty()) json["condition"] = numbers(curve.condition);
  if (!curve.condition_by_theory.empty()) json["condition_by_theory"] = numbers(curve.condition_by_theory);
  if (!curve.min_det.empty()) json["min_det"] = numbers(curve.min_det);
  return json;
}

OrderedJson to_json(const PlaneBorder& border) {
  OrderedJson json = {{"method", border.method}, {"kind", border.kind}, {"spacing", numbers(border.spacing)}};
  if (!border.load.empty()) {
    json["load"] = border.load;
    json["push"] = numbers(border.push);
  }
  return json;
}

template <class Part>
OrderedJson all_of(const std::vector<Part>& parts) {
  OrderedJson array = OrderedJson::array();
  for (const Part& part : parts) array.push_back(to_json(part));
  return array;
}

std::string measured(const StabilityRow& row) {
  if (row.at_failure) return fmt::format("{:.4g}", *row.at_failure);
  return row.swept_to != 0 ? fmt::format("none to {:g}", row.swept_to) : "none";
}

std::string theory(const StabilityRow& row) {
  if (row.theory) return fmt::format("{:.4g}", *row.theory);
  if (row.theory_range) return fmt::format("{:g} … {:g}", (*row.theory_range)[0], (*row.theory_range)[1]);
  return "";
}

/// Escapes bars, which would begin the next cell of a table.
std::string cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return escaped;
}

}  // namespace

std::string to_json(const StabilityReport& report) {
  const OrderedJson json = {{"quick", report.quick},
                            {"rows", all_of(report.rows)},
                            {"curves", all_of(report.curves)},
                            {"plane", all_of(report.plane)}};
  return json.dump(1) + "\n";
}

std::string to_markdown(const std::vector<StabilityRow>& rows) {
  std::string text =
      "| method | sweep | at failure | of | theory | kind |\n"
      "|---|---|---|---|---|---|\n";
  for (const StabilityRow& row : rows)
    text += fmt::format("| {} | {} | {} | {} | {} | {} |\n", row.method, cell(row.sweep), measured(row),
                        cell(row.parameter), theory(row), row.kind);
  return text;
}

std::string to_csv(const std::vector<StabilityCurve>& curves) {
  const auto value = [](const std::vector<double>& values, std::size_t i) {
    return values.empty() ? "" : fmt::format("{:g}", values[i]);
  };
  std::string text = "method,sweep,parameter,at,condition,condition_by_theory,min_det\n";
  for (const StabilityCurve& c : curves)
    for (std::size_t i = 0; i < c.at.size(); ++i)
      text += fmt::format("{},\"{}\",\"{}\",{:g},{},{},{}\n", c.method, c.sweep, c.parameter, c.at[i],
                          value(c.condition, i), value(c.condition_by_theory, i), value(c.min_det, i));
  return text;
}

std::string to_csv(const std::vector<PlaneBorder>& plane) {
  std::string text = "method,load,kind,spacing,push\n";
  for (const PlaneBorder& border : plane)
    for (std::size_t i = 0; i < border.spacing.size(); ++i)
      text += fmt::format("{},{},{},{:g},{}\n", border.method, border.load, border.kind, border.spacing[i],
                          border.push.empty() ? "" : fmt::format("{:g}", border.push[i]));
  return text;
}

}  // namespace brachy
