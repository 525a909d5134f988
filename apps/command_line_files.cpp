// The command lines of the tools that work on files alone: deform, inspect, zwidth, advise, plot-force.
#include <memory>

#include "apps/command_line_parts.h"
#include "core/error.h"
#include "core/ladder/ladder.h"

namespace brachy {

ToolLine add_deform(CLI::App& app) {
  auto options = std::make_shared<DeformOptions>();
  auto* command =
      app.add_subcommand("deform", "Deform points or a mesh by landmarks, exactly and without a clock.");
  command->footer(
      "Examples:\n"
      "  brachy deform --landmarks L.csv --points P.csv --kernel psi31 --support 12 --out O.csv\n"
      "  brachy deform --landmarks L.csv --points P.csv --scene scene.toml --kernel elastic --out O.csv\n"
      "  brachy deform --landmarks L.csv --mesh M.stl --kernel elastic --poisson 0.49 --core-radius 2 --out "
      "O.ply\n"
      "Landmarks: x,y,z,dx,dy,dz[,core_mm][,support] (an anchor has zeros). Points: x,y,z. Out: "
      "x,y,z,dx,dy,dz[,det]. mm.\n"
      "elastic and fem take landmarks that follow each other along a line for a needle's shaft of the "
      "scene's\n"
      "radius, one alone for a contact; a core_mm > 0 makes a landmark a point of that core radius instead.\n"
      "A column support gives every landmark a support radius of its own (psi kernels), as the paper has it, "
      "for\n"
      "comparison: nothing keeps such a system regular, and it is refused where its condition number is "
      "above "
      "1e12.\n"
      "Without --scene, elastic is an unbounded solid and needs a core radius; fem needs a scene.\n"
      "Exit codes: 0 done, 2 bad input, 3 refused (singular or contradictory landmarks; with --strict, "
      "folding).");
  command->add_option("--landmarks", options->landmarks, "CSV x,y,z,dx,dy,dz[,core_mm][,support]")
      ->required();
  auto* points = command->add_option("--points", options->points, "CSV x,y,z");
  auto* mesh = command->add_option("--mesh", options->mesh, "STL, OBJ or PLY; --out is then a PLY");
  points->excludes(mesh);
  command->add_option("--scene", options->scene,
                      "body, moduli, regions and their supports, needle and kernel (TOML)");
  command->add_option("--kernel", options->kernel, "rung of the ladder; default: the scene's, or psi31")
      ->check(CLI::IsMember(rung_names()));
  command
      ->add_option("--support", options->support_mm,
                   "support radius a of a psi kernel, mm; largest one of a compact rung (default 48)")
      ->check(between(1e-6, 1e6));
  command->add_option("--poisson", options->poisson, "Poisson's ratio; default: the scene's, or 0.49")
      ->check(between(0.0, 0.4995));
  command
      ->add_option("--shear-modulus-kpa", options->shear_modulus_kpa,
                   "of the tissue; default: the scene's, or 6")
      ->check(between(1e-3, 1e6));
  command->add_option("--core-radius", options->core_radius_mm, "of every landmark without a core_mm, mm")
      ->check(between(1e-3, 1e3));
  command->add_option("--out", options->out, "file to write")->required();
  command->add_flag("--jacobian", options->jacobian, "also write det(I + ∇u)");
  command->add_flag("--strict", options->strict, "refuse a field that folds at a point");
  command->add_flag("--json", options->json, "print the result as JSON");
  return {command, [options]() -> ToolOptions {
            if (!options->points && !options->mesh) throw UserError("needs --points FILE or --mesh FILE");
            return *options;
          }};
}

ToolLine add_inspect(CLI::App& app) {
  auto options = std::make_shared<InspectOptions>();
  auto* command =
      app.add_subcommand("inspect", "Say what a mesh, a scene's tissue or a recording is made of.");
  command->footer(
      "Examples:\n  brachy inspect prostate.stl\n  brachy inspect config/prostate.toml --json\n"
      "  brachy inspect run1.brachy                      a recording: length, rates, gaps, seeds, damage");
  command->add_option("file", options->file, "STL, OBJ or PLY, a scene (.toml), or a recording")->required();
  add_mesh_options(*command, options->units, options->frame);
  command->add_option("--weld-tolerance-mm", options->weld_tolerance_mm, "vertices closer than this are one")
      ->check(between(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--min-island-share", options->min_island_share, "smaller islands are dropped")
      ->check(between(0.0, 0.5))
      ->capture_default_str();
  command->add_option("--out", options->out, "also write the surface, welded and outward, as PLY");
  command->add_flag("--json", options->json, "print the report as JSON");
  return {command, [options]() -> ToolOptions { return *options; }};
}

ToolLine add_zwidth(CLI::App& app) {
  auto options = std::make_shared<ZWidthOptions>();
  auto damping = std::make_shared<double>(1e3 * options->damping_n_s_per_mm);
  auto* command = app.add_subcommand(
      "zwidth", "Find the stiffest spring a device renders without ringing, against rate and delay.");
  command->footer(
      "Examples:\n"
      "  brachy zwidth --quick                                some cases, a second\n"
      "  brachy zwidth --json zwidth.json --markdown zwidth.md\n"
      "  brachy zwidth --mass-kg 0.045 --damping 1.5\n"
      "A free mass on a spring, in virtual time, through the same code as a device's "
      "(haptics/force/local_force.h): local: the\n"
      "device works out its force; wire: the daemon does. scripts/zwidth.sh does the same and draws the "
      "chart.\n"
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
  return {command, [options, damping]() -> ToolOptions {
            options->damping_n_s_per_mm = 1e-3 * *damping;
            return *options;
          }};
}

ToolLine add_advise(CLI::App& app) {
  auto options = std::make_shared<AdviseOptions>();
  auto* command = app.add_subcommand(
      "advise", "Say which model a scene needs: supports, errors and costs, and the choice.");
  command->footer(
      "Examples:\n  brachy advise config/prostate.toml\n"
      "  brachy advise config/prostate.toml --tolerance-mm 0.2 --tick-budget-ms 5 --json\n"
      "Errors and times are those of the comparison stored in the program (brachy compare), not measured "
      "now.");
  command->add_option("scene", options->scene, "scene file (TOML)")->required();
  command
      ->add_option("--tolerance-mm", options->tolerance_mm, "largest error at a target; default: the scene's")
      ->check(between(1e-3, 100));
  command->add_option("--tick-budget-ms", options->tick_budget_ms, "of one thread; default: the scene's")
      ->check(between(1e-3, 1000));
  command->add_flag("--json", options->json, "print the advice as JSON");
  return {command, [options]() -> ToolOptions { return *options; }};
}

ToolLine add_plot_force(CLI::App& app) {
  auto options = std::make_shared<PlotForceOptions>();
  auto* command = app.add_subcommand("plot-force", "Draw a force log: force against depth and against time.");
  command->footer(
      "Examples:\n"
      "  brachy replay config/insertion_5mm_s.csv --offline --log force.csv; brachy plot-force force.csv\n"
      "  brachy plot-force out/run1/forces.csv --needle 2 --out needle2.svg --json\n"
      "Solid lines: on the way in; dashed ones: on the way out. Axial forces above 0 push the needle out.\n"
      "Exit codes: 0 done, 2 bad input.");
  command->add_option("log", options->log, "CSV of `brachy replay --offline --log` or `brachy record`")
      ->required();
  command->add_option("--out", options->out, "SVG to write; default: the log's name with .svg");
  command->add_option("--needle", options->needle, "default: the first one in the log")
      ->check(CLI::Range(0, 15));
  command->add_flag("--json", options->json, "print what was read and its peaks as JSON");
  return {command, [options]() -> ToolOptions { return *options; }};
}

}  // namespace brachy
