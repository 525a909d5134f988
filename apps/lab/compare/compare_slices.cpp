#include "apps/lab/compare/compare_slices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/lab/compare/report.h"
#include "apps/lab/slices/slice_file.h"
#include "core/base/error.h"

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// A number as report.cpp writes it: omitted where it is 0, null where JSON cannot represent it.
double number(const OrderedJson& row, const char* key) {
  if (!row.contains(key)) return 0;
  return row[key].is_null() ? std::numeric_limits<double>::quiet_NaN() : row[key].get<double>();
}

CompareRow row_of(const OrderedJson& json) {
  CompareRow row;
  json.at("model").get_to(row.model);
  json.at("family").get_to(row.family);
  json.at("scene").get_to(row.scene);
  json.at("group").get_to(row.group);
  json.at("counts").get_to(row.counts);
  json.at("listed").get_to(row.listed);
  json.at("kernel").get_to(row.kernel);
  json.at("anchors").get_to(row.has_anchors);
  json.at("surface").get_to(row.is_surface);
  row.landmark_spacing_mm = number(json, "landmark_spacing_mm");
  row.support_mm = number(json, "support_mm");
  if (json.contains("error")) {
    json["error"].get_to(row.error);
    return row;
  }
  row.rel_l2 = number(json, "rel_l2");
  row.max_mm = number(json, "max_mm");
  row.target_mm = number(json, "target_mm");
  row.target_max_mm = number(json, "target_max_mm");
  row.setup_ms = number(json, "setup_ms");
  row.tick_ms = number(json, "tick_ms");
  row.advance_ms = number(json, "advance_ms");
  json.at("ticks_to_rest").get_to(row.ticks_to_rest);
  json.at("bytes").get_to(row.bytes);
  row.min_det = number(json, "min_det");
  return row;
}

std::string sentence_on_times(const std::vector<OrderedJson>& slices) {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const OrderedJson& slice : slices) {
    if (!slice.at("yardstick_ms").is_number())
      return "Times are each slice's own; slices without a yardstick cannot be compared.\n";
    least = std::min(least, slice["yardstick_ms"].get<double>());
    most = std::max(most, slice["yardstick_ms"].get<double>());
  }
  return fmt::format(
      "Times are each slice's own, errors do not depend on it. The same tick ({}) took {:.3g} to {:.3g} ms "
      "in the {} slices: times of different slices compare within {:.0f} %.\n",
      kYardstick, least, most, slices.size(), std::ceil(100 * (most / least - 1)));
}

}  // namespace

std::string to_json(const ComparePlan& plan, const Slice& slice, std::optional<double> yardstick_ms,
                    const std::vector<CompareRow>& rows) {
  OrderedJson json =
      slice_file("compare", slice, {{"quick", plan.quick}, {"scenes", plan.scenes}, {"models", plan.models}});
  json["yardstick_ms"] = yardstick_ms ? OrderedJson(*yardstick_ms) : OrderedJson(nullptr);
  json["rows"] = OrderedJson::parse(to_json(rows, plan.quick)).at("rows");
  return json.dump(1) + "\n";
}

MergedComparison merge_comparison(const std::vector<std::filesystem::path>& files) {
  const std::vector<OrderedJson> slices = read_slice_files(files, "compare");
  try {
    const OrderedJson& run = slices.at(0).at("run");
    const auto scenes = run.at("scenes").get<std::vector<std::string>>(),
               models = run.at("models").get<std::vector<std::string>>();
    MergedComparison merged;
    OrderedJson all = {
        {"quick", run.at("quick")}, {"simd", run.at("simd")}, {"yardstick_ms", OrderedJson::array()}};
    for (const OrderedJson& slice : slices) all["yardstick_ms"].push_back(slice.at("yardstick_ms"));
    all["rows"] = OrderedJson::array();
    std::vector<std::size_t> taken(slices.size());
    for (std::size_t s = 0; s < scenes.size(); ++s)
      for (std::size_t m = 0; m < models.size(); ++m) {
        const std::size_t from = (s + m) % slices.size();
        const OrderedJson& rows = slices[from].at("rows");
        const OrderedJson row = taken[from] < rows.size() ? rows[taken[from]++] : OrderedJson();
        if (!row.is_object() || row.at("scene") != scenes[s] || row.at("model") != models[m])
          throw UserError(
              fmt::format("--merge: slice {} lacks the row of {} on {} where it should be: run it again",
                          slices[from].at("slice").get<std::string>(), models[m], scenes[s]));
        merged.rows.push_back(row_of(row));
        all["rows"].push_back(row);
        all["rows"].back()["slice"] = from + 1;
      }
    merged.json = all.dump(1) + "\n";
    merged.times = sentence_on_times(slices);
    return merged;
  } catch (const nlohmann::json::exception& e) {
    throw UserError(std::string("--merge: a slice is damaged: ") + e.what());
  }
}

}  // namespace brachy
