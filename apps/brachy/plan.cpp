#include <iostream>
#include <sstream>

#include "apps/brachy/output_file.h"
#include "apps/brachy/plan_report.h"
#include "apps/brachy/plan_session.h"
#include "apps/brachy/structure_files.h"
#include "apps/brachy/tools.h"
#include "apps/terminal/progress.h"
#include "core/dose/dose_seed_file.h"
#include "core/error.h"
#include "core/number_text.h"
#include "core/plan/plan_file.h"
#include "core/plan/plan_generator.h"
#include "core/scene/scene_file.h"
#include "core/structures/load_structures.h"
#include "core/surface/surface_bvh.h"

namespace brachy {
namespace {

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
  throw UserError("no plan: name one, or a scene with plan.file, or have one made with --generate");
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

}  // namespace

int plan(const PlanOptions& options) {
  for (const auto& file : {options.out, options.csv, options.seeds, options.trajectory})
    check_folder_of(file);
  const Scene scene = options.config ? load_scene(*options.config) : Scene();
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

}  // namespace brachy
