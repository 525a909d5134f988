#include <iostream>
#include <sstream>

#include "apps/brachy/files/structure_files.h"
#include "apps/brachy/offline/hdr_plan_tool.h"
#include "apps/brachy/offline/plan_report.h"
#include "apps/brachy/offline/plan_session.h"
#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/plan/plan_generator.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

struct PlanOptions {
  std::optional<std::filesystem::path> plan;    ///< none: the scene's
  bool generate = false;                        ///< generate one instead
  std::optional<std::filesystem::path> config;  ///< none: the built-in phantom
  std::optional<std::filesystem::path> out, csv, seeds, structures, trajectory;  ///< to write
  double speed_mm_s = 50, drop_speed_mm_s = 20;                                  ///< of the trajectory
  bool hdr = false;  ///< catheters, whatever the scene says
  bool json = false, force = false;
};

Plan get_plan(const PlanOptions& options, const Scene& scene, const std::vector<Structure>& structures) {
  if (options.generate) {
    Progress progress("plan");
    return generate_plan(structures, scene.template_grid,
                         {scene.name, scene.seeds.source, scene.dose.prescription_gy, scene.needle.length_mm,
                          static_cast<std::size_t>(scene.seeds.max_count)},
                         [&](double share) { progress.show(share, "ways to load the gland"); });
  }
  if (options.plan) return load_plan(*options.plan, scene.template_grid, scene.needle.length_mm);
  if (auto plan = load_plan(scene)) return *plan;
  throw UserError("no plan: name one, or a scene with plan.file, or generate one with --generate");
}

std::string seeds_csv(const Plan& plan, const TemplateGrid& grid) {
  std::string text = std::string(kDoseSeedHeader) + "\n";
  for (const PlannedSeed& seed : plan.seeds(grid)) {
    for (const Vec3* v : {&seed.position, &seed.axis})
      for (int k = 0; k < 3; ++k) text += exact_text((*v)[k]) + ",";
    text += std::string(to_string(seed.source)) + "," + exact_text(seed.air_kerma_strength_u) + "\n";
  }
  return text;
}

std::string session_csv(const Plan& plan, const TemplateGrid& grid, const PlanOptions& options) {
  std::ostringstream text;
  write_trajectory(text, session_of(plan, grid, {options.speed_mm_s, options.drop_speed_mm_s}));
  return text.str();
}

double customary_strength_u(const Structure& gland) {
  const SurfaceBvh surface(gland.mesh);
  const double mean_cm = (surface.max() - surface.min()).sum() / 30;
  return 2.15 * mean_cm * mean_cm;
}

int run(const PlanOptions& options) {
  if (options.out && options.out->extension() != ".toml" && options.out->extension() != ".csv")
    throw UsageError("--out writes a plan: name it .toml or .csv");
  for (const auto& file : {options.out, options.csv, options.seeds, options.trajectory}) {
    check_folder_of(file);
    if (file) check_is_no_input(*file, {options.plan, options.config});
    check_is_new(file, options.force);
  }
  Scene scene = options.config ? load_scene(*options.config) : Scene();
  if (options.hdr && !scene.implant.is_hdr()) make_hdr(scene);
  if (scene.implant.is_hdr() || (options.plan && is_hdr_plan_file(*options.plan)))
    return run_hdr_plan({options.plan, options.generate, options.out, options.seeds, options.structures,
                         options.trajectory, options.speed_mm_s, options.json},
                        scene);
  const std::vector<Structure> structures = load_structures(scene);
  const Plan plan = get_plan(options, scene, structures);
  const TemplateGrid& grid = scene.template_grid;

  if (options.out)
    write_text(*options.out, options.out->extension() == ".csv" ? to_csv(plan) : to_toml(plan));
  if (options.csv) write_text(*options.csv, to_csv(plan));
  if (options.seeds) write_text(*options.seeds, seeds_csv(plan, grid));
  if (options.structures) write_structures(*options.structures, structures);
  if (options.trajectory) write_text(*options.trajectory, session_csv(plan, grid, options));

  const PlanReport report{plan, grid, score_dose(plan, grid, structures, scene.dose, nullptr).plan,
                          customary_strength_u(structures.front())};
  std::cout << (options.json ? to_json(report) + "\n" : to_text(report));
  return kExitOk;
}

void declare(OptionList& list, PlanOptions& options) {
  const Option plan = list.add("plan", options.plan, "plan (.toml or .csv); default: the scene's plan.file");
  list.add_flag("--generate", options.generate, "generate a plan for the scene's gland").excludes(plan);
  list.add_flag("--hdr", options.hdr, "of catheters for an afterloader, as with implant.kind = \"hdr\"");
  list.add("--config", options.config, "scene file (TOML); default: the built-in phantom");
  list.add("--out", options.out, "plan to write, .toml or .csv");
  list.add("--csv", options.csv, "plan to write as CSV");
  list.add("--seeds", options.seeds, "CSV to write, for `brachy dose`: x,y,z,ax,ay,az,source,strength_u");
  list.add("--structures", options.structures, "directory to write the structures to (.vtp, .pvd)");
  const Option trajectory =
      list.add("--trajectory", options.trajectory, "CSV to write: a session by the plan");
  list.add("--speed-mm-s", options.speed_mm_s, "of the session's tip")
      .range(0.1, 1000.0)
      .show_default()
      .needs(trajectory);
  list.add("--drop-speed-mm-s", options.drop_speed_mm_s, "of the tip while it drops its seeds")
      .range(0.1, 1000.0)
      .show_default()
      .needs(trajectory);
  list.add_flag("--force", options.force, "overwrite files that exist");
  list.add_flag("--json", options.json, "print the report as JSON");
}

}  // namespace

Tool plan_tool() {
  return make_tool<PlanOptions>("plan", "Generate a plan for a scene, or check one: needles, seeds, dose.",
                                R"(Examples:
  brachy plan --generate --config config/prostate.toml --out plan.toml
  brachy plan plan.toml --config config/prostate.toml --json
  brachy plan plan.toml --seeds seeds.csv --structures out/structures; brachy dose --seeds seeds.csv …
  brachy plan --config config/session.toml --trajectory session.csv
  brachy plan --generate --hdr --out hdr.toml; brachy plan --config config/hdr.toml --trajectory hdr.csv
A generated plan is modified peripheral loading, scaled to dose.prescription_gy; no optimiser. A plan is
checked against the scene's template and needle. Figures are of the gland at rest; those that miss their goal
are marked.
HDR (--hdr, or a scene's implant.kind): catheters, dwell positions and times optimised for V100, V150, urethra
D10 and D2cc; --seeds writes the dwells as seeds of the same dose; --trajectory inserts all catheters, each a
needle of its own, and leaves them.
--trajectory: a device that goes to every planned tip in turn and drops its train there (button = 1), for
`brachy replay` and a scene with seeds.applicator = "train".
Exit codes: 0 done, 2 bad input.)",
                                declare, run);
}

}  // namespace brachy
