// The command lines of the tools that sweep, and of their slices: compare, stability.
#include <memory>

#include "apps/command_line_parts.h"

namespace brachy {
namespace {

/// --slice and --merge, which go with --json: `of_whole` are options of a whole run or a merge, `of_run` of a run.
void add_slice_options(CLI::App& command, std::optional<Slice>& slice,
                       std::vector<std::filesystem::path>& merge, const std::vector<std::string>& of_whole,
                       const std::vector<std::string>& of_run) {
  const CLI::Validator is_slice = {[](const std::string& text) -> std::string {
                                     if (find_slice(text)) return "";
                                     return "needs I/N with 1 <= I <= N, such as 2/8, not '" + text + "'";
                                   },
                                   "I/N"};
  const auto take = [&slice](const std::string& text) { slice = find_slice(text); };
  auto* part = command
                   .add_option_function<std::string>(
                       "--slice", take, "run only this part of N, and write it as --json for --merge")
                   ->check(is_slice)
                   ->needs(command.get_option("--json"));
  auto* whole =
      command.add_option("--merge", merge, "run nothing: make one of the files that all slices wrote");
  part->excludes(whole);
  for (const std::string& option : of_whole) part->excludes(command.get_option(option));
  for (const std::string& option : of_run) whole->excludes(command.get_option(option));
}

}  // namespace

ToolLine add_compare(CLI::App& app) {
  auto options = std::make_shared<CompareOptions>();
  auto* command = app.add_subcommand(
      "compare", "Run every model on every reference scene: errors, times, memory, as a table.");
  command->footer(
      "Examples:\n"
      "  brachy compare --quick                                       the listed models, a minute\n"
      "  brachy compare --json compare.json --markdown compare.md     all, with the sweep over supports\n"
      "  brachy compare --models psi31_a12,elastic --scenes lateral   those whose names begin so\n"
      "  brachy compare --beads truthcube/beads.csv                   against measured beads instead\n"
      "  brachy compare --slice 2/8 --json out/2.json                 one of eight parts, on any machine\n"
      "  brachy compare --merge out/*.json --markdown compare.md      all of them as one\n"
      "Beads: i,j,k,x0,y0,z0,x1,y1,z1,… mm at rest and under loads. Those at the ends of the lattice predict "
      "the\n"
      "others; parameters are chosen on the first load's outer beads alone and applied to every load.\n"
      "scripts/compare.sh does the same and draws the charts. Times are one thread's; leave the cores "
      "alone.\n"
      "Merged slices have the errors of one run bit for bit. Times are each slice's own: what the same tick "
      "took "
      "in\n"
      "every slice is told below the table. scripts/sweep.slurm runs slices as an array of Slurm's.\n"
      "Exit codes: 0 done, 1 no model had an answer, 2 bad input.");
  command->add_option("--references", options->references,
                      "folder of reference scenes; default: the installed or the sources' tests/reference");
  auto* beads = command->add_option("--beads", options->beads, "CSV i,j,k,x0,y0,z0,x1,y1,z1,…");
  command->add_option("--json", options->json, "write all rows as JSON");
  command->add_option("--markdown", options->markdown, "write the table, which is printed anyway");
  command->add_option("--models", options->models, "beginnings of model names, comma-separated")
      ->delimiter(',');
  command->add_option("--scenes", options->scenes, "beginnings of scene names, comma-separated")
      ->delimiter(',');
  command->add_flag("--quick", options->quick, "listed models only, ticks timed for less long");
  add_slice_options(*command, options->slice, options->merge, {"--beads", "--markdown"},
                    {"--beads", "--references", "--models", "--scenes", "--quick"});
  for (const char* other : {"--references", "--markdown", "--models", "--scenes", "--quick"})
    beads->excludes(command->get_option(other));
  return {command, [options]() -> ToolOptions { return *options; }};
}

ToolLine add_stability(CLI::App& app) {
  auto options = std::make_shared<StabilityOptions>();
  auto* command =
      app.add_subcommand("stability", "Sweep every method until it fails: where, how, and what theory says.");
  command->footer(
      "Examples:\n"
      "  brachy stability --quick                            smaller cases, seconds\n"
      "  brachy stability --json stability.json --out data   all; table, curves and borders as files too\n"
      "  brachy stability --scene my.toml --sweeps push,anchor\n"
      "  brachy stability --slice 2/4 --json out/2.json      some of the sweeps, on any machine\n"
      "  brachy stability --merge out/*.json --out data      all slices as one\n"
      "Sweeps: push, plane, anchor, spacing, precision, support_ratio, poisson, time_step, lattice, "
      "coplanar.\n"
      "JSON: rows (method, sweep, parameter, at_failure or null where it did not fail up to swept_to, theory "
      "or "
      "null\n"
      "or theory_range, kind), curves (condition, min_det against the parameter), plane (borders of failure "
      "over\n"
      "spacing/support and push/support). kind law: a constant that theory states, measured; nothing "
      "failed.\n"
      "scripts/stability.sh does the same and draws the charts.\n"
      "Exit codes: 0 done, 2 bad input.");
  command->add_option("--scene", options->scene,
                      "body, needle, support and anchors (TOML); default: the phantom");
  command->add_option("--json", options->json, "write rows, curves and borders as JSON");
  command->add_option("--out", options->out, "folder for stability.md, curves.csv and plane.csv");
  command->add_option("--sweeps", options->sweeps, "names, comma-separated; default: all")->delimiter(',');
  command->add_flag("--quick", options->quick, "fewer and smaller cases");
  add_slice_options(*command, options->slice, options->merge, {"--out"}, {"--scene", "--sweeps", "--quick"});
  return {command, [options]() -> ToolOptions { return *options; }};
}

}  // namespace brachy
