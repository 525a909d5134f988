#include <algorithm>
#include <functional>
#include <iostream>
#include <optional>

#include "apps/command_line/options.h"
#include "apps/lab/compare/reference_scene.h"
#include "apps/lab/program/report_files.h"
#include "apps/lab/program/study.h"
#include "apps/lab/program/wanted.h"
#include "apps/lab/ticks/tick_errors.h"
#include "apps/terminal/progress.h"

namespace brachy {
namespace {

// Of --quick.
const std::vector<std::string> kQuickScenes = {"lateral", "drag", "indentation", "sphere_4", "insertion_20"};

struct Measured {
  std::string name;
  std::optional<ShownModel> shown;         // of the daemon …
  const ModelEntry* comparator = nullptr;  // … or a comparator
};

bool is_comparator(const ModelEntry& model) {
  return model.family != "psi" && model.family != "matrix";
}

std::vector<LargeMotion> load_motions(const TicksOptions& options) {
  const auto references = options.references ? *options.references : default_references();
  auto folders = find_reference_scenes(references / "large_motion");
  if (options.quick && options.scenes.empty())
    std::erase_if(folders, [](const auto& folder) {
      return std::ranges::find(kQuickScenes, folder_name(folder)) == kQuickScenes.end();
    });
  keep_wanted(folders, folder_name, options.scenes, "--scenes");
  std::vector<LargeMotion> motions;
  motions.reserve(folders.size());
  for (const auto& folder : folders) motions.push_back(load_large_motion(folder));
  return motions;
}

}  // namespace

int ticks(const TicksOptions& options) {
  const std::vector<ModelEntry> others = all_models(true);
  std::vector<Measured> models;
  for (const ShownModel& model : options.choices ? models_to_choose_from() : default_models())
    models.push_back({model.name, model});
  for (const ModelEntry& entry : others)
    if (is_comparator(entry) && !options.choices) models.push_back({entry.name, {}, &entry});
  keep_wanted(models, std::mem_fn(&Measured::name), options.models, "--models");

  const std::vector<LargeMotion> motions = load_motions(options);
  std::vector<TickRow> rows;
  Progress progress("ticks");
  std::size_t done = 0;
  for (const LargeMotion& motion : motions)
    for (const Measured& model : models) {
      progress.show_step(done++, motions.size() * models.size(), motion.name + ", " + model.name);
      if (model.comparator && motion.is_by_forces) continue;  // they know no forces
      const std::vector<TickRow> levels =
          model.comparator ? measure_comparator(*model.comparator, motion, options.quick ? 5 : 15)
                           : measure_ticks(*model.shown, motion);
      rows.insert(rows.end(), levels.begin(), levels.end());
      if (levels.front().error.empty()) continue;
      progress.finish();
      std::cerr << "ticks: " << motion.name << ", " << model.name << ": " << levels.front().error << "\n";
    }
  progress.finish();
  write_report(options.json, to_json(rows, options.quick), options.markdown, to_markdown(rows));
  check_results(rows);
  return kExitOk;
}

}  // namespace brachy
