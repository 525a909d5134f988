#include "apps/brachy/offline/hdr_plan_tool.h"

#include <fmt/format.h>

#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/brachy/files/structure_files.h"
#include "apps/brachy/offline/hdr_session.h"
#include "apps/command_line/exit_code.h"
#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/score/hdr_report.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/hdr/dwell_doses.h"
#include "core/brachytherapy/hdr/hdr_generator.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/robust/robust_planning.h"
#include "core/scene/choose_source.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

HdrPlan get_hdr_plan(const HdrPlanRequest& request, const Scene& scene,
                     const std::vector<Structure>& structures) {
  if (request.generate) {
    Progress progress("plan");
    const HdrPlan plan = generate_hdr_plan(
        structures, scene.template_grid,
        {scene.name, scene.seeds.source, scene.implant, scene.dose.prescription_gy, scene.needle.length_mm},
        [&](double share) { progress.show(share, "of the catheters' choice and times"); });
    if (!request.robust) return plan;
    return with_robust_times(plan, structures, scene.template_grid, scene.dose,
                             scene.goals.empty() ? hdr_dose_goals() : scene.goals, scene.uncertainty,
                             [&](double share) { progress.show(share, "of times for drawn treatments"); });
  }
  if (request.plan) return load_hdr_plan(*request.plan, scene.template_grid, scene.needle.length_mm);
  if (auto plan = load_hdr_plan(scene)) return *plan;
  throw UserError(
      "no plan of catheters: name one, or a scene with plan.file, or generate one with --generate");
}

std::string plan_text(const HdrPlan& plan) {
  std::string text = fmt::format("plan \"{}\": {} catheters, {} dwells of {} in {:.1f} s, {:g} U; {:g} Gy\n",
                                 plan.name, plan.catheters.size(), plan.dwell_count(), to_string(plan.source),
                                 plan.total_s(), plan.source_strength_u, plan.prescription_gy);
  text += fmt::format("  {:<6}{:>9}   seconds every {:g} mm, the first {:g} mm behind the tip\n", "hole",
                      "tip, mm", plan.step_mm, plan.tip_offset_mm);
  for (const PlanCatheter& c : plan.catheters) {
    text += c.has_course() ? fmt::format("  {:<6}{:>9}  ", c.name, "course")
                           : fmt::format("  {:<6}{:>9g}  ", c.hole, c.tip_mm);
    for (const double s : c.dwell_s) text += fmt::format(" {:g}", s);
    text += "\n";
  }
  return text;
}

std::string plan_json(const HdrPlan& plan, const TemplateGrid& grid,
                      const std::vector<StructureDose>& doses) {
  nlohmann::ordered_json json = {{"kind", "hdr"},
                                 {"name", plan.name},
                                 {"source", to_string(plan.source)},
                                 {"source_strength_u", plan.source_strength_u},
                                 {"prescription_gy", plan.prescription_gy},
                                 {"catheter_count", plan.catheters.size()},
                                 {"dwell_count", plan.dwell_count()},
                                 {"total_s", plan.total_s()}};
  for (std::size_t c = 0; c < plan.catheters.size(); ++c) {
    const Vec3 tip = plan.planned_tip(grid, c);
    json["catheters"].push_back({{"hole", plan.catheters[c].label()},
                                 {"tip_mm", {tip.x(), tip.y(), tip.z()}},
                                 {"dwell_s", plan.catheters[c].dwell_s}});
  }
  json["figures"] = nlohmann::ordered_json::parse(hdr_dose_json(doses, plan.prescription_gy));
  return json.dump();
}

}  // namespace

void make_hdr(Scene& scene) {
  scene.implant.kind = "hdr";
  if (scene.dose.prescription_gy == DoseSettings().prescription_gy)
    scene.dose.prescription_gy = ImplantSettings::kFractionGy;
  choose_source(scene);
}

bool is_hdr_plan_file(const std::filesystem::path& file) {
  if (file.extension() != ".toml") return false;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return is_hdr_plan(text.str());
}

int run_hdr_plan(const HdrPlanRequest& request, const Scene& scene) {
  if (request.out && request.out->extension() != ".toml")
    throw UsageError("--out writes a plan of catheters: name it .toml");
  const std::vector<Structure> structures = load_structures(scene);
  const TemplateGrid& grid = scene.template_grid;
  const HdrPlan plan = get_hdr_plan(request, scene, structures);
  if (request.out) write_text(*request.out, to_toml(plan, grid), request.force);
  if (request.seeds) write_text(*request.seeds, to_csv(plan.seeds(grid)), request.force);
  if (request.structures) write_structures(*request.structures, structures, request.force);
  if (request.trajectory)
    write_text(*request.trajectory, hdr_session_csv(plan, grid, request.speed_mm_s), request.force);
  DoseSettings settings = scene.dose;
  settings.prescription_gy = plan.prescription_gy;
  ImplantDose dose(structures, settings);
  for (const DoseSeed& seed : plan.seeds(grid)) dose.add(seed);
  const std::vector<StructureDose> doses = dose.evaluate();
  if (request.json)
    std::cout << plan_json(plan, grid, doses) << "\n";
  else
    std::cout << plan_text(plan) << "dose, the gland at rest (! misses its goal):\n"
              << hdr_dose_text({{"plan", &doses}}, plan.prescription_gy);
  return kExitOk;
}

}  // namespace brachy
