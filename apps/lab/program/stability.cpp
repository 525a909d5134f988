#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iostream>

#include "apps/command_line/options.h"
#include "apps/command_line/output_file.h"
#include "apps/lab/program/study.h"
#include "apps/lab/stability/stability_slices.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"
#include "core/scene/file/scene_file.h"

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
      throw UserError(fmt::format("--sweeps: there is no {}; choose from {}", name, names));
  return sweeps;
}

/// The report of each sweep, separately.
std::vector<StabilityReport> run(const std::vector<Sweep>& sweeps, const StabilityOptions& options) {
  StabilityScene scene(options.scene ? load_scene(*options.scene) : Scene{}, options.quick);
  std::vector<StabilityReport> parts;
  Progress progress("stability");
  double done = 0, all = 0;
  for (const Sweep& sweep : sweeps) all += sweep.weight;
  for (const Sweep& sweep : sweeps) {
    progress.show(done / all, sweep.name);
    parts.push_back({.quick = options.quick, .rows = {}, .curves = {}, .plane = {}});
    sweep.run(scene, parts.back());
    done += sweep.weight;
  }
  return parts;
}

template <class Part>
void append(std::vector<Part>& to, const std::vector<Part>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

StabilityReport joined(const std::vector<StabilityReport>& parts, bool quick) {
  StabilityReport report{.quick = quick, .rows = {}, .curves = {}, .plane = {}};
  for (const StabilityReport& part : parts) {
    append(report.rows, part.rows);
    append(report.curves, part.curves);
    append(report.plane, part.plane);
  }
  return report;
}

std::string text_of(const std::optional<std::filesystem::path>& file) {
  if (!file) return "";
  std::ifstream in(*file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

int stability(const StabilityOptions& options) {
  const std::vector<Sweep> sweeps = choose_sweeps(options.sweeps);
  if (options.out) {
    std::error_code failed;
    std::filesystem::create_directories(*options.out, failed);
    if (failed) throw UserError(options.out->string() + ": cannot be created: " + failed.message());
  }
  StabilityReport report;
  if (!options.merge.empty()) {
    report = merge_stability(options.merge);
  } else {
    const std::vector<Sweep> ours = options.slice ? sweeps_of(*options.slice, sweeps) : sweeps;
    const std::vector<StabilityReport> parts = run(ours, options);
    report = joined(parts, options.quick);
    // Files that exist were refused before the run (study_line.cpp).
    if (options.slice)
      write_text(*options.json,
                 to_json(*options.slice, sweeps, text_of(options.scene), options.quick, ours, parts), true);
  }
  const std::string table = to_markdown(report.rows);
  if (options.json && !options.slice) write_text(*options.json, to_json(report), true);
  if (options.out) {
    write_text(*options.out / "stability.md", table, true);
    write_text(*options.out / "curves.csv", to_csv(report.curves), true);
    write_text(*options.out / "plane.csv", to_csv(report.plane), true);
  }
  std::cout << table;
  return kExitOk;
}

}  // namespace brachy
