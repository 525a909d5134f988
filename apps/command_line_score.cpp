// The command lines of the tools that judge what a hand did: metrics, score.
#include <memory>

#include "apps/command_line_parts.h"

namespace brachy {

ToolLine add_metrics(CLI::App& app) {
  auto options = std::make_shared<MetricsOptions>();
  auto* command = app.add_subcommand(
      "metrics", "Measure a needle trajectory against a tissue: times, paths, passes, speeds.");
  command->footer(
      "Examples:\n"
      "  brachy metrics out/run1/poses.csv --mesh prostate.stl\n"
      "  brachy metrics tracked.csv --mesh tissue.stl --frame LPS --json\n"
      "  brachy inspect config/prostate.toml --out gland.ply; brachy metrics t.csv --mesh gland.ply\n"
      "As Perk Tutor defines them: a segment between two poses is in the tissue when its end is inside the "
      "closed\n"
      "mesh; a pass is from outside to inside of the tip and of the points 1 mm before and behind it. "
      "Percentiles are\n"
      "of the tip's speed over each segment. With several needles paths, times in tissue and passes add up.\n"
      "Exit codes: 0 done, 2 bad input.");
  command->add_option("trajectory", options->trajectory, "CSV: t_s,m00,…,m23[,needle][,button] (X_WN, mm)")
      ->required();
  command->add_option("--mesh", options->mesh, "STL, OBJ or PLY of the tissue, closed")->required();
  add_mesh_options(*command, options->units, options->frame);
  command->add_flag("--json", options->json, "print the metrics as JSON");
  return {command, [options]() -> ToolOptions { return *options; }};
}

ToolLine add_score(CLI::App& app) {
  auto options = std::make_shared<ScoreOptions>();
  auto* command =
      app.add_subcommand("score", "Judge a recorded session against its plan; write report.html and .json.");
  command->footer(
      "Examples:\n"
      "  brachy score out/run1 --plan plan.toml\n"
      "  brachy score out/run1 --plan plan.csv --config patient.toml --out run1.html --json\n"
      "A recording is a folder with poses.csv, forces.csv and seeds.csv; what is missing or cut off is said, "
      "and the\n"
      "rest is scored. Per seed: error against plan, its part along the needle apart, where it fell and "
      "after\n"
      "relaxation. Per needle: path and time in the prostate, passes, punctures, largest force. Dose of "
      "plan, of seeds\n"
      "as dropped and after relaxation. For training and research. Not a medical device.\n"
      "Exit codes: 0 done, 2 bad input.");
  command->add_option("recording", options->recording, "folder of a session or of `brachy record`")
      ->required();
  command->add_option("--plan", options->plan, "TOML or CSV; default: the scene's");
  command->add_option("--config", options->config, "the session's scene; default: the built-in phantom");
  command->add_option("--out", options->out,
                      "page to write, the JSON beside it; default: report.html in the recording");
  command->add_flag("--json", options->json, "print the whole report as JSON");
  return {command, [options]() -> ToolOptions { return *options; }};
}

}  // namespace brachy
