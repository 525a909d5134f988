#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/offline/hdr_plan_tool.h"
#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"
#include "core/base/number_csv.h"
#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/hdr/dwell_doses.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/robust/robust_evaluation.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

struct RobustOptions {
  std::optional<std::filesystem::path> plan;    ///< none: the scene's
  std::optional<std::filesystem::path> config;  ///< none: the built-in phantom
  int draws = 1000;
  std::uint64_t seed = 1;
  std::optional<std::filesystem::path> csv;    ///< the figures of all draws
  std::optional<int> draw;                     ///< whose patient is told and whose seeds are written
  std::optional<std::filesystem::path> seeds;  ///< of that draw
  bool json = false, force = false;
};

/// The plan to judge: of one kind or the other.
struct JudgedPlan {
  std::string name;
  PlannedSources sources;
  bool is_hdr = false;
};

JudgedPlan judged(const HdrPlan& plan, const TemplateGrid& grid) {
  return {plan.name, PlannedSources::of(plan, grid), true};
}
JudgedPlan judged(const Plan& plan, const TemplateGrid& grid) {
  return {plan.name, PlannedSources::of(plan, grid), false};
}

JudgedPlan get_plan(const RobustOptions& options, const Scene& scene) {
  const TemplateGrid& grid = scene.template_grid;
  if (options.plan) {
    if (is_hdr_plan_file(*options.plan))
      return judged(load_hdr_plan(*options.plan, grid, scene.needle.length_mm), grid);
    return judged(load_plan(*options.plan, grid, scene.needle.length_mm), grid);
  }
  if (const auto plan = load_hdr_plan(scene)) return judged(*plan, grid);
  if (const auto plan = load_plan(scene)) return judged(*plan, grid);
  throw UserError("no plan: name one, or a scene with plan.file");
}

/// "prostate V100 ≥ 97 %"
std::string goal_text(const DoseGoal& goal, double prescription_gy) {
  const DoseIndex* index = find_dose_index(goal.figure);
  return fmt::format("{} {} {} {:.4g} {}", goal.structure, goal.figure, goal.is_above() ? "≥" : "<",
                     goal.limit_for(prescription_gy), unit_text(index->unit));
}

/// Standard error of a share of so many draws, in points.
double error_points(double share, std::size_t draws) {
  return 100 * std::sqrt(share * (1 - share) / static_cast<double>(draws));
}

std::string to_text(const JudgedPlan& plan, const RobustResult& result, const RobustSettings& settings) {
  const double gy = plan.sources.prescription_gy;
  const double all = static_cast<double>(result.all_met) / static_cast<double>(settings.draws);
  std::string text = fmt::format("plan \"{}\": {} {}; {} treatments drawn from the scene's [uncertainty]{}\n",
                                 plan.name, plan.sources.sources.size(), plan.is_hdr ? "dwells" : "seeds",
                                 settings.draws, plan.is_hdr ? "" : " and [noise]");
  text += fmt::format("  {:<30}{:>9}{:>9}{:>9}{:>9}   met by\n", "goal", "planned", "5 %", "median", "95 %");
  for (const RobustGoal& goal : result.goals) {
    text += fmt::format("  {:<30}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}   {:.1f} % (± {:.1f})\n",
                        goal_text(goal.goal, gy), goal.planned, goal.quantile(0.05), goal.quantile(0.5),
                        goal.quantile(0.95), 100 * goal.share_met(),
                        error_points(goal.share_met(), settings.draws));
  }
  text += fmt::format("  all of them{:>56}   {:.1f} % (± {:.1f})\n", "", 100 * all,
                      error_points(all, settings.draws));
  text += fmt::format("  the draw that misses them by most: --draw {}\n", result.worst);
  return text;
}

nlohmann::ordered_json json_of(const ImplantDraw& draw, std::size_t number) {
  const Vec3& moved = draw.organs_moved_mm;
  return {{"number", number},
          {"gland_outline_mm", draw.gland_outline_mm},
          {"urethra_outline_mm", draw.urethra_outline_mm},
          {"organ_outline_mm", draw.organ_outline_mm},
          {"organs_moved_mm", {moved.x(), moved.y(), moved.z()}},
          {"stretch", draw.stretch}};
}

nlohmann::ordered_json json_of(const JudgedPlan& plan, const RobustResult& result,
                               const RobustSettings& settings) {
  nlohmann::ordered_json json = {
      {"plan", plan.name},
      {"prescription_gy", plan.sources.prescription_gy},
      {"sources", plan.sources.sources.size()},
      {"draws", settings.draws},
      {"random_seed", settings.random_seed},
      {"all_met_percent", 100.0 * static_cast<double>(result.all_met) / static_cast<double>(settings.draws)},
      {"worst_draw", result.worst}};
  for (const RobustGoal& goal : result.goals)
    json["goals"].push_back({{"structure", goal.goal.structure},
                             {"figure", goal.goal.figure},
                             {"side", goal.goal.side},
                             {"limit", goal.goal.limit_for(plan.sources.prescription_gy)},
                             {"planned", goal.planned},
                             {"p5", goal.quantile(0.05)},
                             {"median", goal.quantile(0.5)},
                             {"p95", goal.quantile(0.95)},
                             {"met_percent", 100 * goal.share_met()}});
  return json;
}

std::string to_csv(const RobustResult& result) {
  std::string text = "draw";
  for (const RobustGoal& goal : result.goals) text += "," + goal.goal.structure + " " + goal.goal.figure;
  text += "\n";
  for (std::size_t n = 0; n < result.goals.front().drawn.size(); ++n) {
    std::vector<double> row = {static_cast<double>(n)};
    for (const RobustGoal& goal : result.goals) row.push_back(goal.drawn[n]);
    append_csv_row(text, row);
    text += "\n";
  }
  return text;
}

int run_robust(const RobustOptions& options) {
  const Scene scene = options.config ? load_scene(*options.config) : Scene();
  const JudgedPlan plan = get_plan(options, scene);
  const std::vector<Structure> structures = load_structures(scene);
  DoseSettings dose = scene.dose;
  dose.prescription_gy = plan.sources.prescription_gy;
  const std::vector<DoseGoal> goals = !scene.goals.empty() ? scene.goals
                                      : plan.is_hdr        ? hdr_dose_goals()
                                                           : default_dose_goals();
  const RobustSettings settings{scene.uncertainty, seed_misplacement(scene),
                                static_cast<std::size_t>(options.draws), options.seed};
  Progress progress("robust");
  const RobustResult result =
      RobustJudge(structures, dose, goals, settings).judge(plan.sources, [&](double share) {
        progress.show(share, "of the treatments");
      });
  progress.finish();
  if (options.csv) write_text(*options.csv, to_csv(result), options.force);
  nlohmann::ordered_json json = json_of(plan, result, settings);
  if (options.draw) {
    const auto number = static_cast<std::size_t>(*options.draw);
    const ImplantDraw draw = draw_implant(plan.sources, middle_of(structures.front()), settings.uncertainty,
                                          settings.misplacement, settings.random_seed, number);
    if (options.seeds) write_text(*options.seeds, brachy::to_csv(draw.seeds), options.force);
    json["draw"] = json_of(draw, number);
  }
  std::cout << (options.json ? json.dump() + "\n" : to_text(plan, result, settings));
  if (options.draw && !options.json) std::cout << "  draw: " << json["draw"].dump() << "\n";
  return kExitOk;
}

void declare_robust(OptionList& list, RobustOptions& options) {
  list.add("plan", options.plan,
           "plan (.toml or .csv), of seeds or catheters; default: the scene's plan.file");
  list.add("--config", options.config,
           "scene file (TOML) with [uncertainty], [noise] and [[goal]]s; default: the built-in phantom");
  list.add("--draws", options.draws, "treatments").range(1, 1'000'000).show_default();
  list.add("--random-seed", options.seed, "of the draws").show_default();
  list.add_output("--csv", options.csv, "CSV to write: a row for each draw, a column for each goal's figure");
  const Option draw =
      list.add("--draw", options.draw, "tell how the patient of this draw differs").range(0, 999'999);
  list.add_output("--seeds", options.seeds,
                  "CSV to write, for `brachy dose`: the sources of that draw, in the frame of the gland")
      .needs(draw);
  list.add_force(options.force);
  list.add_flag("--json", options.json, "print the report as JSON");
}

}  // namespace

Tool robust_tool() {
  return make_tool<RobustOptions>(
      "robust", "How probable it is that a plan meets its goals, under what nobody can know.",
      R"(Draws treatments by the plan from the standard deviations of the scene's [uncertainty] (config/KEYS.md):
source strength, dose calculation, dwell times, catheters, outlines, movement, swelling; for seeds also [noise]. Prints
for each goal what the plan has, the 5 %, 50 % and 95 % of the treatments have, and how many of them meet it.

Examples:
  brachy robust config/plan.toml --config config/prostate.toml
  brachy robust hdr.toml --config config/hdr.toml --draws 10000 --csv draws.csv
  brachy robust hdr.toml --config config/hdr.toml --draw 412 --seeds worst.csv
)",
      declare_robust, run_robust);
}

}  // namespace brachy
