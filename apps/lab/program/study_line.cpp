// The command line of brachy-study.
#include <functional>
#include <iostream>
#include <memory>

#include "apps/command_line/command_line_parts.h"
#include "apps/command_line/output_file.h"
#include "apps/command_line/study_commands.h"
#include "apps/lab/program/study.h"
#include "core/base/error.h"
#include "core/base/escaped.h"

namespace brachy {
namespace {

/// One command. `take` is called with its options once it was parsed.
struct StudyLine {
  CLI::App* command;
  std::function<StudyOptions()> take;
};

CLI::App* add_command(CLI::App& app, std::string_view name) {
  const auto* found =
      std::ranges::find_if(kStudyCommands, [&](const StudyCommand& c) { return c.name == name; });
  return app.add_subcommand(found->name, found->summary);
}

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
  auto* whole = command.add_option("--merge", merge, "run nothing: merge the files that all slices wrote");
  part->excludes(whole);
  for (const std::string& option : of_whole) part->excludes(command.get_option(option));
  for (const std::string& option : of_run) whole->excludes(command.get_option(option));
}

/// What to run on reference scenes, and where its rows go.
void add_row_options(CLI::App& command, ReferenceRunOptions& options) {
  command.add_option("--json", options.json, "write all rows as JSON");
  command.add_option("--markdown", options.markdown, "write the table, which is printed anyway");
  command.add_option("--models", options.models, "beginnings of model names, comma-separated")
      ->delimiter(',');
  command.add_option("--scenes", options.scenes, "beginnings of scene names, comma-separated")
      ->delimiter(',');
}

StudyLine add_compare(CLI::App& app) {
  auto options = std::make_shared<CompareOptions>();
  auto* command = add_command(app, "compare");
  command->footer(
      "Examples:\n"
      "  brachy compare --quick                                       the listed models, a minute\n"
      "  brachy compare --json compare.json --markdown compare.md     all, with the sweep over supports\n"
      "  brachy compare --models psi31_a12,elastic --scenes lateral   those whose names begin like this\n"
      "  brachy compare --beads truthcube/beads.csv                   against measured beads instead\n"
      "  brachy compare --slice 2/8 --json out/2.json                 one of eight parts, on any machine\n"
      "  brachy compare --merge out/*.json --markdown compare.md      all of them as one\n"
      "Beads: i,j,k,x0,y0,z0,x1,y1,z1,… mm at rest and under loads. Those at the ends of the lattice\n"
      "predict the others; parameters are chosen on the first load's outer beads alone and applied to every\n"
      "load.\n"
      "scripts/charts/compare.sh does the same and draws the charts. Times are one thread's; leave the "
      "cores\n"
      "alone.\n"
      "Merged slices have the errors of one run bit for bit. Each slice measures its own times; the time of\n"
      "one tick that all slices measured is reported below the table. scripts/campaigns/sweep.slurm runs\n"
      "slices as a Slurm array.\n"
      "Exit codes: 0 done, 1 no model had a result, 2 bad input.");
  command->add_option("--references", options->references,
                      "folder of reference scenes; default: the installed or the sources' tests/reference");
  auto* beads = command->add_option("--beads", options->beads, "CSV i,j,k,x0,y0,z0,x1,y1,z1,…");
  add_row_options(*command, *options);
  command->add_flag("--quick", options->quick, "listed models only, ticks timed for less long");
  add_slice_options(*command, options->slice, options->merge, {"--beads", "--markdown"},
                    {"--beads", "--references", "--models", "--scenes", "--quick"});
  for (const char* other : {"--references", "--markdown", "--models", "--scenes", "--quick"})
    beads->excludes(command->get_option(other));
  return {command, [options]() -> StudyOptions { return *options; }};
}

StudyLine add_stability(CLI::App& app) {
  auto options = std::make_shared<StabilityOptions>();
  auto* command = add_command(app, "stability");
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
      "or null\n"
      "or theory_range, kind), curves (condition, min_det against the parameter), plane (borders of failure "
      "over\n"
      "spacing/support and push/support). kind law: a constant that theory states, measured; nothing "
      "failed.\n"
      "scripts/charts/stability.sh does the same and draws the charts.\n"
      "Exit codes: 0 done, 2 bad input.");
  command->add_option("--scene", options->scene,
                      "body, needle, support and anchors (TOML); default: the phantom");
  command->add_option("--json", options->json, "write rows, curves and borders as JSON");
  command->add_option("--out", options->out, "folder for stability.md, curves.csv and plane.csv");
  command->add_option("--sweeps", options->sweeps, "names, comma-separated; default: all")->delimiter(',');
  command->add_flag("--quick", options->quick, "fewer and smaller cases");
  add_slice_options(*command, options->slice, options->merge, {"--out"}, {"--scene", "--sweeps", "--quick"});
  return {command, [options]() -> StudyOptions { return *options; }};
}

StudyLine add_ticks(CLI::App& app) {
  auto options = std::make_shared<TicksOptions>();
  auto* command = add_command(app, "ticks");
  command->footer(
      "Examples:\n"
      "  brachy ticks --quick                                  some of the scenes, half a minute\n"
      "  brachy ticks --json ticks.json --markdown ticks.md\n"
      "  brachy ticks --models psi31,elastic --scenes lateral  those whose names begin like this\n"
      "The fields that the daemon's models show at motions of 2, 4, 6 and 8 mm by the default policy, and "
      "those of\n"
      "comparators, against tests/reference/large_motion. scripts/charts/ticks.sh does the same, measures "
      "the\n"
      "ticks of running daemons and draws the chart.\n"
      "Exit codes: 0 done, 1 no model had a result, 2 bad input.");
  command->add_option("--references", options->references,
                      "folder with large_motion; default: the installed or the sources' tests/reference");
  add_row_options(*command, *options);
  command->add_flag("--quick", options->quick, "some of the scenes only");
  command->add_flag("--choices", options->choices,
                    "every setting that [model] kernel = \"auto\" chooses among, timed; no comparators");
  return {command, [options]() -> StudyOptions { return *options; }};
}

StudyLine add_lag(CLI::App& app) {
  auto options = std::make_shared<LagOptions>();
  auto* command = add_command(app, "lag");
  command->footer(
      "Examples:\n"
      "  brachy lag                                   all scenarios, a minute or two\n"
      "  brachy lag --scenarios 16 --json lag.json    those whose names begin like this\n"
      "A tick evaluates as much tissue as it has time for, by count. Lag: the largest distance of a point "
      "that is\n"
      "shown from where whole ticks of the same poses show it. scripts/charts/lag.sh measures the ticks of "
      "running\n"
      "daemons beside it.\n"
      "Exit codes: 0 done, 2 bad input.");
  command->add_option("--json", options->json, "write the rows as JSON");
  command->add_option("--markdown", options->markdown, "write the table, which is printed anyway");
  command->add_option("--daemon-files", options->daemon_files,
                      "folder for scene and trajectory of each scenario, NAME.toml and NAME.csv");
  command->add_option("--scenarios", options->scenarios, "beginnings of names, comma-separated")
      ->delimiter(',');
  return {command, [options]() -> StudyOptions { return *options; }};
}

StudyLine add_zwidth(CLI::App& app) {
  auto options = std::make_shared<ZWidthOptions>();
  auto damping = std::make_shared<double>(1e3 * options->damping_n_s_per_mm);
  auto* command = add_command(app, "zwidth");
  command->footer(
      "Examples:\n"
      "  brachy zwidth --quick                                some cases, a second\n"
      "  brachy zwidth --json zwidth.json --markdown zwidth.md\n"
      "  brachy zwidth --mass-kg 0.045 --damping 1.5\n"
      "A free mass on a spring, in virtual time, through the same code as a device's "
      "(haptics/force/local_force.h): local: the\n"
      "device works out its force; wire: the daemon does. scripts/charts/zwidth.sh does the same and draws "
      "the chart.\n"
      "Exit codes: 0 every case under the negotiated limit is calm, 1 one rings, 2 bad input.");
  command->add_option("--mass-kg", options->mass_kg, "of the device at its tip")
      ->check(between(0.001, 10.0))
      ->capture_default_str();
  command->add_option("--damping", *damping, "of the device, N·s/m")
      ->check(between(0.001, 1000.0))
      ->capture_default_str();
  command->add_option("--json", options->json, "write the points as JSON");
  command->add_option("--markdown", options->markdown, "write the table");
  command->add_flag("--quick", options->quick, "fewer cases");
  return {command, [options, damping]() -> StudyOptions {
            options->damping_n_s_per_mm = 1e-3 * *damping;
            return *options;
          }};
}

StudyLine add_deflection(CLI::App& app) {
  auto options = std::make_shared<DeflectionOptions>();
  auto* command = add_command(app, "deflection");
  command->footer(
      "Examples:\n"
      "  brachy deflection phantom_a.csv phantom_b.csv\n"
      "  brachy deflection phantom_a.csv --calibrate-depth-mm 0 --json deflection.json\n"
      "Files: insertion,step,depth_mm,x_mm,z_mm, one phantom each: the tip of a bevel-tip needle that is "
      "pushed\n"
      "straight in without turning, at least four insertions. Of every three the bevel's force, the entry "
      "angle and the\n"
      "phantom's modulus are fitted; the others are predicted from these and from their own first poses.\n"
      "Exit codes: 0 all predictions are within 0.5 mm at the end and 0.3 mm rms, 1 not all, 2 bad input.");
  command->add_option("files", options->files, "CSV")->required();
  command
      ->add_option("--calibrate-depth-mm", options->calibrate_mm,
                   "of an insertion, what its prediction is told")
      ->check(between(0.0, 1000.0))
      ->capture_default_str();
  command->add_option("--bending-stiffness-nmm2", options->bending_stiffness_nmm2, "EI; an 18 G tube's")
      ->check(between(1.0, 1e7))
      ->capture_default_str();
  command->add_option("--needle-length-mm", options->needle_length_mm, "from the hub")
      ->check(between(20.0, 1000.0))
      ->capture_default_str();
  command->add_option("--json", options->json, "write fits and errors as JSON");
  command->add_option("--markdown", options->markdown, "write the tables");
  return {command, [options]() -> StudyOptions { return *options; }};
}

/// Refuses files that exist, before hours of computing, unless --force is given.
void check_outputs(const CLI::App& command) {
  const bool force = command.count("--force") > 0;
  for (const char* name : {"--json", "--markdown"})
    if (command.get_option_no_throw(name) != nullptr && command.count(name) > 0)
      check_output(command.get_option(name)->as<std::string>(), force);
  if (command.get_option_no_throw("--out") == nullptr || command.count("--out") == 0) return;
  const std::filesystem::path folder = command.get_option("--out")->as<std::string>();
  for (const char* name : {"stability.md", "curves.csv", "plane.csv"})
    if (std::filesystem::is_directory(folder)) check_output(folder / name, force);
}

}  // namespace

StudyOptions parse_study_line(int argc, char** argv, std::optional<int>& exit_code) {
  const std::string name = std::filesystem::path(argc > 0 ? argv[0] : "").filename();
  CLI::App app("Studies of the brachytherapy simulator's models and methods.",
               name == "brachy" ? name : "brachy-study");
  app.require_subcommand(1);
  app.footer(app.get_name() + " COMMAND --help describes a command, with examples.");
  const StudyLine lines[] = {add_compare(app), add_stability(app), add_ticks(app),
                             add_lag(app),     add_zwidth(app),    add_deflection(app)};
  for (const StudyLine& line : lines) line.command->add_flag("--force")->description("overwrite what exists");
  const auto* json = app.add_flag("--json")->description("with --version: print it as JSON");
  exit_code = parse_arguments(app, argc, argv);
  if (!exit_code && *json) {
    std::cerr << app.get_name() << ": --json before a command goes with --version alone\nTry --help.\n";
    exit_code = kExitBadInput;
  }
  if (exit_code) return {};
  for (const StudyLine& line : lines)
    if (*line.command) {
      try {
        check_outputs(*line.command);
      } catch (const UserError& e) {
        std::cerr << "brachy: " << escaped(e.what()) << "\n";
        exit_code = kExitBadInput;
        return {};
      }
      return line.take();
    }
  return {};
}

}  // namespace brachy
