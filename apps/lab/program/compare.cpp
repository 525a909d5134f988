#include <fmt/format.h>

#include <functional>
#include <iostream>

#include "apps/command_line/options.h"
#include "apps/lab/compare/compare_beads.h"
#include "apps/lab/compare/compare_slices.h"
#include "apps/lab/compare/report.h"
#include "apps/lab/program/report_files.h"
#include "apps/lab/program/study.h"
#include "apps/lab/program/wanted.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"

namespace brachy {
namespace {

std::vector<ModelEntry> choose_models(const CompareOptions& options) {
  // A model that is named is run with --quick too.
  std::vector<ModelEntry> models = all_models(options.quick && options.models.empty());
  keep_wanted(models, std::mem_fn(&ModelEntry::name), options.models, "--models");
  return models;
}

std::vector<std::filesystem::path> choose_scenes(const CompareOptions& options) {
  auto folders = find_reference_scenes(options.references ? *options.references : default_references());
  keep_wanted(folders, folder_name, options.scenes, "--scenes");
  return folders;
}

/// The time of a tick that every slice takes, so that times on different machines can be compared.
std::optional<double> yardstick_ms(const ReferenceScene& scene, const Effort& effort) {
  for (const ModelEntry& model : all_models(false)) {
    if (model.name != kYardstick) continue;
    const CompareRow row = measure(model, scene, effort);
    if (row.error.empty()) return row.tick_ms;
  }
  return std::nullopt;
}

std::vector<CompareRow> run(const std::vector<ReferenceScene>& scenes, const std::vector<ModelEntry>& models,
                            const Slice& slice, const Effort& effort) {
  const auto slices = static_cast<std::size_t>(slice.count);
  const std::size_t most = (scenes.size() * models.size() + slices - 1) / slices;
  std::vector<CompareRow> rows;
  Progress progress("compare");
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    for (std::size_t m = 0; m < models.size(); ++m) {
      if (!ComparePlan::has_row(slice, s, m)) continue;
      progress.show_step(rows.size(), most, scenes[s].name + ", " + models[m].name);
      rows.push_back(measure(models[m], scenes[s], effort));
      if (rows.back().error.empty()) continue;
      progress.finish();
      std::cerr << fmt::format("compare: {}, {}: {}\n", scenes[s].name, models[m].name, rows.back().error);
    }
  }
  return rows;
}

int report(const CompareOptions& options, const std::vector<CompareRow>& rows, const std::string& json,
           const std::string& below_table = "") {
  write_report(options.json, json, options.markdown, to_markdown(rows) + below_table);
  if (!options.slice) check_results(rows);  // a slice may have no result; the merge reports that
  return kExitOk;
}

}  // namespace

int compare(const CompareOptions& options) {
  if (options.beads) return compare_beads(*options.beads, options.json, std::cout);
  if (!options.merge.empty()) {
    const MergedComparison merged = merge_comparison(options.merge);
    return report(options, merged.rows, merged.json, "\n" + merged.times);
  }
  const std::vector<ModelEntry> models = choose_models(options);
  const auto folders = choose_scenes(options);
  Effort effort;
  if (options.quick) effort = {.tick_budget_ms = 20, .least_ticks = 5, .most_ticks = 100};

  std::vector<ReferenceScene> scenes;  // all of them first, so that a bad file is reported at once
  scenes.reserve(folders.size());
  for (const auto& folder : folders) scenes.push_back(load_reference_scene(folder));
  const std::vector<CompareRow> rows = run(scenes, models, options.slice.value_or(Slice{}), effort);
  if (!options.slice) return report(options, rows, to_json(rows, options.quick));

  ComparePlan plan{.quick = options.quick, .scenes = {}, .models = {}};
  for (const ReferenceScene& scene : scenes) plan.scenes.push_back(scene.name);
  for (const ModelEntry& model : models) plan.models.push_back(model.name);
  return report(options, rows, to_json(plan, *options.slice, yardstick_ms(scenes.at(0), effort), rows));
}

}  // namespace brachy
