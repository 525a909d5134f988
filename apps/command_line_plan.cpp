// The command line of the tool that makes and checks plans.
#include <memory>

#include "apps/command_line_parts.h"
#include "core/error.h"

namespace brachy {

ToolLine add_plan(CLI::App& app) {
  auto options = std::make_shared<PlanOptions>();
  auto* command = app.add_subcommand("plan", "Make a plan for a scene, or check one: needles, seeds, dose.");
  command->footer(
      "Examples:\n"
      "  brachy plan --generate --config config/prostate.toml --out plan.toml\n"
      "  brachy plan plan.toml --config config/prostate.toml --json\n"
      "  brachy plan plan.toml --seeds seeds.csv --structures out/structures; brachy dose --seeds seeds.csv "
      "…\n"
      "  brachy plan --config config/session.toml --trajectory session.csv\n"
      "A generated plan is modified peripheral loading, scaled to dose.prescription_gy; no optimiser. A plan "
      "is checked\n"
      "against the scene's template and needle. Figures are of the gland at rest; those that miss their goal "
      "are marked.\n"
      "--trajectory: a device that goes to every planned tip in turn and leaves its train there (button = "
      "1), for\n"
      "`brachy replay` and a scene with seeds.applicator = \"train\".\n"
      "Exit codes: 0 done, 2 bad input.");
  auto* plan =
      command->add_option("plan", options->plan, "plan (.toml or .csv); default: the scene's plan.file");
  command->add_flag("--generate", options->generate, "make one for the scene's gland")->excludes(plan);
  command->add_option("--config", options->config, "scene file (TOML); default: the built-in phantom");
  command->add_option("--out", options->out, "plan to write, .toml or .csv");
  command->add_option("--csv", options->csv, "plan to write as CSV");
  command->add_option("--seeds", options->seeds,
                      "CSV to write, for `brachy dose`: x,y,z,ax,ay,az,source,strength_u");
  command->add_option("--structures", options->structures, "folder to write the structures to (.vtp, .pvd)");
  auto* trajectory =
      command->add_option("--trajectory", options->trajectory, "CSV to write: a session by the plan");
  command->add_option("--speed-mm-s", options->speed_mm_s, "of the session's tip")
      ->check(between(0.1, 1000.0))
      ->capture_default_str()
      ->needs(trajectory);
  command->add_option("--drop-speed-mm-s", options->drop_speed_mm_s, "of the tip while it leaves its seeds")
      ->check(between(0.1, 1000.0))
      ->capture_default_str()
      ->needs(trajectory);
  command->add_flag("--json", options->json, "print the report as JSON");
  return {command, [options]() -> ToolOptions {
            if (options->out && options->out->extension() != ".toml" && options->out->extension() != ".csv")
              throw UserError("--out writes a plan: name it .toml or .csv");
            return *options;
          }};
}

}  // namespace brachy
