#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "apps/brachy/output_file.h"
#include "apps/brachy/tools.h"
#include "apps/compare/compare_beads.h"
#include "apps/compare/report.h"
#include "apps/terminal/progress.h"
#include "core/error.h"

namespace brachy {
namespace {

/// Whether `name` begins with one of `wanted`, or nothing is wanted.
bool is_wanted(const std::string& name, const std::vector<std::string>& wanted) {
  return wanted.empty() || std::ranges::any_of(wanted, [&](const auto& w) { return name.starts_with(w); });
}

/// UserError where one of `wanted` is the beginning of no name.
void check_wanted(const std::vector<std::string>& wanted, const std::vector<std::string>& names,
                  const std::string& option) {
  for (const std::string& w : wanted) {
    if (std::ranges::any_of(names, [&](const auto& name) { return name.starts_with(w); })) continue;
    std::string all;
    for (const auto& name : names) all.append(all.empty() ? "" : ", ").append(name);
    throw UserError(fmt::format("{}: there is no {}; there are {}", option, w, all));
  }
}

std::vector<ModelEntry> choose_models(const CompareOptions& options) {
  // A name that is asked for is run in quick form too.
  std::vector<ModelEntry> models = all_models(options.quick && options.models.empty());
  std::vector<std::string> names;
  names.reserve(models.size());
  for (const ModelEntry& model : models) names.push_back(model.name);
  check_wanted(options.models, names, "--models");
  std::erase_if(models, [&](const ModelEntry& model) { return !is_wanted(model.name, options.models); });
  return models;
}

std::vector<std::filesystem::path> choose_scenes(const CompareOptions& options) {
  auto folders = find_reference_scenes(options.references ? *options.references : default_references());
  std::vector<std::string> names;
  names.reserve(folders.size());
  for (const auto& folder : folders) names.push_back(folder.filename().string());
  check_wanted(options.scenes, names, "--scenes");
  std::erase_if(folders, [&](const auto& f) { return !is_wanted(f.filename().string(), options.scenes); });
  return folders;
}

}  // namespace

int compare(const CompareOptions& options) {
  if (options.beads) return compare_beads(*options.beads, options.json, std::cout);
  check_folder_of(options.json);
  check_folder_of(options.markdown);
  const std::vector<ModelEntry> models = choose_models(options);
  const auto folders = choose_scenes(options);
  Effort effort;
  if (options.quick) effort = {.tick_budget_ms = 20, .least_ticks = 5, .most_ticks = 100};

  std::vector<ReferenceScene> scenes;  // all of them first, so that a bad file is known at once
  scenes.reserve(folders.size());
  for (const auto& folder : folders) scenes.push_back(load_reference_scene(folder));
  std::vector<CompareRow> rows;
  std::size_t answered = 0;
  Progress progress("compare");
  for (const ReferenceScene& scene : scenes) {
    for (const ModelEntry& model : models) {
      progress.show_step(rows.size(), scenes.size() * models.size(), scene.name + ", " + model.name);
      rows.push_back(measure(model, scene, effort));
      answered += rows.back().error.empty();
      if (rows.back().error.empty()) continue;
      progress.finish();
      std::cerr << fmt::format("compare: {}, {}: {}\n", scene.name, model.name, rows.back().error);
    }
  }
  progress.finish();
  const std::string table = to_markdown(rows);
  if (options.json) write_text(*options.json, to_json(rows, options.quick));
  if (options.markdown) write_text(*options.markdown, table);
  std::cout << table;
  if (answered == 0) {
    std::cerr << "brachy: no model had an answer for any scene\n";
    return kExitFailed;
  }
  return kExitOk;
}

}  // namespace brachy
