#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "apps/brachy/output_file.h"
#include "apps/brachy/tools.h"
#include "apps/stability/sweeps.h"
#include "apps/terminal/progress.h"
#include "core/error.h"
#include "core/scene/scene_file.h"

namespace brachy {
namespace {

std::vector<Sweep> choose_sweeps(const std::vector<std::string>& wanted) {
  std::vector<Sweep> sweeps;
  std::string names;
  for (const Sweep& sweep : all_sweeps()) {
    names.append(names.empty() ? "" : ", ").append(sweep.name);
    if (wanted.empty() || std::ranges::find(wanted, sweep.name) != wanted.end()) sweeps.push_back(sweep);
  }
  for (const std::string& name : wanted)
    if (std::ranges::none_of(sweeps, [&](const Sweep& sweep) { return sweep.name == name; }))
      throw UserError(fmt::format("--sweeps: there is no {}; there are {}", name, names));
  return sweeps;
}

}  // namespace

int stability(const StabilityOptions& options) {
  const std::vector<Sweep> sweeps = choose_sweeps(options.sweeps);
  check_folder_of(options.json);
  StabilityScene scene(options.scene ? load_scene(*options.scene) : Scene{}, options.quick);
  if (options.out) {
    std::error_code failed;
    std::filesystem::create_directories(*options.out, failed);
    if (failed) throw UserError(options.out->string() + ": cannot be made a folder: " + failed.message());
  }
  StabilityReport report{.quick = options.quick, .rows = {}, .curves = {}, .plane = {}};
  Progress progress("stability");
  double done = 0, all = 0;
  for (const Sweep& sweep : sweeps) all += sweep.weight;
  for (const Sweep& sweep : sweeps) {
    progress.show(done / all, sweep.name);
    sweep.run(scene, report);
    done += sweep.weight;
  }
  progress.finish();
  const std::string table = to_markdown(report.rows);
  if (options.json) write_text(*options.json, to_json(report));
  if (options.out) {
    write_text(*options.out / "stability.md", table);
    write_text(*options.out / "curves.csv", to_csv(report.curves));
    write_text(*options.out / "plane.csv", to_csv(report.plane));
  }
  std::cout << table;
  return kExitOk;
}

}  // namespace brachy
