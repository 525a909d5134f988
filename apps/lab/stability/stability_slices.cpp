#include "apps/lab/stability/stability_slices.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "apps/lab/slices/slice_file.h"
#include "core/base/error.h"

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// As written by stability_report.cpp: JSON has no infinity.
double number(const OrderedJson& json) {
  return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>();
}

std::vector<double> numbers(const OrderedJson& json, const char* key) {
  std::vector<double> values;
  if (json.contains(key))
    for (const OrderedJson& value : json[key]) values.push_back(number(value));
  return values;
}

StabilityRow row_of(const OrderedJson& json) {
  StabilityRow row;
  json.at("method").get_to(row.method);
  json.at("sweep").get_to(row.sweep);
  json.at("parameter").get_to(row.parameter);
  json.at("kind").get_to(row.kind);
  if (!json.at("at_failure").is_null()) row.at_failure = json["at_failure"].get<double>();
  if (!json.at("swept_to").is_null()) row.swept_to = json["swept_to"].get<double>();
  if (!json.at("theory").is_null()) row.theory = json["theory"].get<double>();
  if (json.contains("theory_range")) row.theory_range = json["theory_range"].get<std::array<double, 2>>();
  return row;
}

StabilityCurve curve_of(const OrderedJson& json) {
  StabilityCurve curve;
  json.at("method").get_to(curve.method);
  json.at("sweep").get_to(curve.sweep);
  json.at("parameter").get_to(curve.parameter);
  curve.at = numbers(json, "at");
  curve.condition = numbers(json, "condition");
  curve.condition_by_theory = numbers(json, "condition_by_theory");
  curve.min_det = numbers(json, "min_det");
  return curve;
}

PlaneBorder border_of(const OrderedJson& json) {
  PlaneBorder border;
  json.at("method").get_to(border.method);
  json.at("kind").get_to(border.kind);
  border.spacing = numbers(json, "spacing");
  if (json.contains("load")) json["load"].get_to(border.load);
  border.push = numbers(json, "push");
  return border;
}

}  // namespace

std::vector<Sweep> sweeps_of(const Slice& slice, const std::vector<Sweep>& sweeps) {
  std::vector<std::size_t> longest_first(sweeps.size());
  std::iota(longest_first.begin(), longest_first.end(), std::size_t{0});
  std::ranges::stable_sort(longest_first, std::greater(), [&](std::size_t i) { return sweeps[i].weight; });
  std::vector<double> loads(static_cast<std::size_t>(slice.count));
  std::vector<std::size_t> ours;
  for (const std::size_t i : longest_first) {
    const auto least = std::ranges::min_element(loads);
    *least += sweeps[i].weight;
    if (least - loads.begin() == slice.index - 1) ours.push_back(i);
  }
  std::ranges::sort(ours);
  std::vector<Sweep> taken;
  taken.reserve(ours.size());
  for (const std::size_t i : ours) taken.push_back(sweeps[i]);
  return taken;
}

std::string to_json(const Slice& slice, const std::vector<Sweep>& all, const std::string& scene, bool quick,
                    const std::vector<Sweep>& swept, const std::vector<StabilityReport>& parts) {
  OrderedJson names = OrderedJson::array();
  for (const Sweep& sweep : all) names.push_back(sweep.name);
  OrderedJson json = slice_file("stability", slice, {{"quick", quick}, {"sweeps", names}, {"scene", scene}});
  json["parts"] = OrderedJson::object();
  for (std::size_t i = 0; i < swept.size(); ++i)
    json["parts"][swept[i].name] = OrderedJson::parse(to_json(parts[i]));
  return json.dump(1) + "\n";
}

StabilityReport merge_stability(const std::vector<std::filesystem::path>& files) {
  const std::vector<OrderedJson> slices = read_slice_files(files, "stability");
  try {
    const OrderedJson& run = slices.at(0).at("run");
    StabilityReport merged{.quick = run.at("quick").get<bool>(), .rows = {}, .curves = {}, .plane = {}};
    for (const OrderedJson& sweep : run.at("sweeps")) {
      const auto name = sweep.get<std::string>();
      const auto slice =
          std::ranges::find_if(slices, [&](const OrderedJson& s) { return s.at("parts").contains(name); });
      if (slice == slices.end())
        throw UserError(fmt::format("--merge: no slice has the sweep {}: run them again", name));
      const OrderedJson& part = slice->at("parts").at(name);
      for (const OrderedJson& row : part.at("rows")) merged.rows.push_back(row_of(row));
      for (const OrderedJson& curve : part.at("curves")) merged.curves.push_back(curve_of(curve));
      for (const OrderedJson& border : part.at("plane")) merged.plane.push_back(border_of(border));
    }
    return merged;
  } catch (const nlohmann::json::exception& e) {
    throw UserError(std::string("--merge: a slice is damaged: ") + e.what());
  }
}

}  // namespace brachy
