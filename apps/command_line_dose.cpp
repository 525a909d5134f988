// The command lines of the tools about an implant: dose.
#include <memory>

#include "apps/command_line_parts.h"
#include "core/error.h"

namespace brachy {

ToolLine add_dose(CLI::App& app) {
  auto options = std::make_shared<DoseOptions>();
  auto* command =
      app.add_subcommand("dose", "Add up the dose of seeds at points, or over a scene's structures.");
  command->footer(
      "Examples:\n"
      "  brachy dose --seeds S.csv --points P.csv --out O.csv\n"
      "  brachy dose --seeds S.csv --config config/prostate.toml --grid dose.nrrd\n"
      "  brachy dose --seeds S.csv --config config/prostate.toml --json\n"
      "Seeds: x,y,z,ax,ay,az,source,strength_u (axis of any length, source 6711 or 200). Points: x,y,z. mm.\n"
      "Out: x,y,z,dose_rate_cgy_h,total_gy: the rate at implantation and the dose of the whole decay, the\n"
      "exact sums of AAPM TG-43U1's line source in water. Inside a capsule: as on its surface, outwards.\n"
      "--config: V100, D90 and the like of the scene's structures, of what of them lies in a grid of its\n"
      "[dose] spacing and margin about the prostate, within 0.05 % of the exact sum at the grid's points.\n"
      "--grid writes it, in Gy, as 3D Slicer reads it.\n"
      "Exit codes: 0 done, 2 bad input.");
  command->add_option("--seeds", options->seeds, "CSV x,y,z,ax,ay,az,source,strength_u")->required();
  auto* points = command->add_option("--points", options->points, "CSV x,y,z");
  auto* out = command->add_option("--out", options->out, "CSV to write, a row for each point")->needs(points);
  points->needs(out);
  auto* config =
      command->add_option("--config", options->scene, "scene file (TOML) whose structures get a DVH");
  command->add_option("--grid", options->grid, "NRRD file to write, total dose in Gy")->needs(config);
  command->add_flag("--json", options->json, "print the summary as JSON");
  return {command, [options, points, config]() -> ToolOptions {
            if (!*points && !*config) throw UserError("say where: --points and --out, or --config, or both");
            return *options;
          }};
}

}  // namespace brachy
