#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/offline/hdr_plan_tool.h"
#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/session/session_manifest.h"
#include "core/base/number_csv.h"
#include "core/brachytherapy/dose/dose_nrrd.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_structures.h"
#include "core/simulation/body_settings.h"

namespace brachy {
namespace {

struct DoseOptions {
  std::optional<std::filesystem::path> seeds, plan;  ///< CSV; or a plan, of seeds or of catheters
  std::optional<std::filesystem::path> points, out;  ///< CSVs; both or neither
  std::optional<std::filesystem::path> scene;        ///< its structures' DVH
  std::optional<std::filesystem::path> grid;         ///< .nrrd to write; only with a scene
  bool swelling = false;                             ///< of the gland resolves meanwhile; only with a scene
  bool what_if = false;                              ///< a session's seeds in another scene
  bool json = false, force = false;
};

struct PointDoses {
  std::size_t count = 0;
  double least_gy = 0, largest_gy = 0;
};

/// Seeds, or a plan's seeds or dwells.
struct DoseSources {
  std::vector<DoseSeed> seeds;
  double fraction_s = 0;                       ///< of a plan of catheters: its time; 0: seeds that stay
  std::optional<double> prescription_gy = {};  ///< a plan's
};

DoseSources load_sources(const DoseOptions& options, const Scene& scene) {
  if (!options.plan) return {.seeds = at_rest(load_seeds_in_place(*options.seeds))};
  const TemplateGrid& grid = scene.template_grid;
  if (is_hdr_plan_file(*options.plan)) {
    const HdrPlan plan = load_hdr_plan(*options.plan, grid, scene.needle.length_mm);
    return {plan.seeds(grid), plan.total_s(), plan.prescription_gy};
  }
  const Plan plan = load_plan(*options.plan, grid, scene.needle.length_mm);
  const std::vector<PlannedSeed> planned = plan.seeds(grid);
  return {.seeds = {planned.begin(), planned.end()}, .prescription_gy = plan.prescription_gy};
}

PointDoses write_point_doses(const DoseSources& sources, const DoseOptions& options) {
  const NumberTable points = load_number_csv(*options.points, "x,y,z");
  std::string text = "x,y,z,dose_rate_cgy_h,total_gy\n";
  PointDoses result{.count = points.rows()};
  for (std::size_t i = 0; i < points.rows(); ++i) {
    const Vec3 p(points.row(i)[0], points.row(i)[1], points.row(i)[2]);
    double rate = 0, total = 0;
    for (const DoseSeed& seed : sources.seeds) {
      const double of_seed = dose_rate_cgy_h(seed, p);
      rate += of_seed;
      total += total_gy_per_cgy_h(seed.source) * of_seed;
    }
    // A fraction has no rate at implantation: its mean.
    if (sources.fraction_s > 0) rate = total * 100 * 3600 / sources.fraction_s;
    append_csv_row(text, std::array{p.x(), p.y(), p.z(), rate, total});
    text += '\n';
    result.least_gy = i == 0 ? total : std::min(result.least_gy, total);
    result.largest_gy = std::max(result.largest_gy, total);
  }
  write_text(*options.out, text, options.force);
  return result;
}

nlohmann::ordered_json to_json(const StructureDose& dose) {
  return {{"name", dose.name},
          {"volume_cc", dose.volume_cc},
          {"mean_gy", dose.mean_gy},
          {"min_gy", dose.min_gy},
          {"max_gy", dose.max_gy},
          {"v100_percent", dose.v100_percent},
          {"v150_percent", dose.v150_percent},
          {"v200_percent", dose.v200_percent},
          {"v100_cc", dose.v100_cc},
          {"d90_gy", dose.d90_gy},
          {"d30_gy", dose.d30_gy},
          {"d10_gy", dose.d10_gy},
          {"d2cc_gy", dose.d2cc_gy},
          {"d0_1cc_gy", dose.d0_1cc_gy}};  // null where there is none
}

void print_table(const std::vector<StructureDose>& doses, double prescription_gy) {
  std::cout << fmt::format("{:<14}{:>8}{:>8}{:>8}{:>8}{:>10}{:>8}{:>8}{:>8}{:>9}   of {:g} Gy\n", "structure",
                           "cm³", "V100 %", "V150 %", "V200 %", "V100 cm³", "D90 Gy", "D30 Gy", "D10 Gy",
                           "D2cc Gy", prescription_gy);
  for (const StructureDose& d : doses)
    std::cout << fmt::format("{:<14}{:>8.2f}{:>8.1f}{:>8.1f}{:>8.1f}{:>10.2f}{:>8.1f}{:>8.1f}{:>8.1f}{:>9}\n",
                             d.name, d.volume_cc, d.v100_percent, d.v150_percent, d.v200_percent, d.v100_cc,
                             d.d90_gy, d.d30_gy, d.d10_gy,
                             std::isnan(d.d2cc_gy) ? "-" : fmt::format("{:.1f}", d.d2cc_gy));
}

int run(const DoseOptions& options) {
  if (options.seeds.has_value() == options.plan.has_value()) throw UsageError("needs --seeds or --plan");
  if (!options.points && !options.scene) throw UsageError("needs --points with --out, or --config, or both");
  // Seeds that lie beside a session's manifest are of its scene.
  const Scene scene = !options.scene  ? Scene()
                      : options.seeds ? load_scene_for(*options.seeds, options.scene, options.what_if).scene
                                      : load_scene(*options.scene);
  const DoseSources sources = load_sources(options, scene);
  const std::vector<DoseSeed>& seeds = sources.seeds;
  double strength_u = 0;
  for (const DoseSeed& seed : seeds) strength_u += seed.air_kerma_strength_u;
  nlohmann::ordered_json json = {{"seeds", seeds.size()}, {"strength_u", strength_u}};
  if (options.points) {
    const PointDoses points = write_point_doses(sources, options);
    json["points"] = points.count;
    json["least_gy"] = points.least_gy;
    json["largest_gy"] = points.largest_gy;
    if (!options.json)
      std::cout << fmt::format("{}: {} seeds, {:.4g} U; at {} points {:.4g} … {:.4g} Gy\n",
                               options.out->string(), seeds.size(), strength_u, points.count, points.least_gy,
                               points.largest_gy);
  }
  if (options.scene) {
    DoseSettings settings = scene.dose;
    settings.prescription_gy = sources.prescription_gy.value_or(settings.prescription_gy);
    ImplantDose implant(load_structures(scene), settings);
    for (const DoseSeed& seed : seeds) {
      if (options.swelling)
        implant.add_while_swollen(seed, SwellingSettings::kDayZero, SwellingSettings::kResolvedDays);
      else
        implant.add(seed);
    }
    if (options.swelling) json["swelling_resolved_days"] = SwellingSettings::kResolvedDays;
    if (options.grid) write_text(*options.grid, to_nrrd(implant.grid()), options.force);
    const std::vector<StructureDose> doses = implant.evaluate();
    json["prescription_gy"] = settings.prescription_gy;
    for (const StructureDose& dose : doses) json["structures"].push_back(to_json(dose));
    if (!options.json) print_table(doses, settings.prescription_gy);
  }
  if (options.json) std::cout << json.dump() << "\n";
  return kExitOk;
}

void declare(OptionList& list, DoseOptions& options) {
  const Option seeds =
      list.add("--seeds", options.seeds,
               "CSV x,y,z,ax,ay,az,source,strength_u, or a session's seeds.csv: where they are at rest");
  list.add("--plan", options.plan,
           "plan of seeds (.toml, .csv) or of catheters (.toml), for --config's template")
      .excludes(seeds);
  const Option points = list.add("--points", options.points, "CSV x,y,z");
  points.needs(list.add_output("--out", options.out, "CSV to write, a row for each point").needs(points));
  const Option config = list.add("--config", options.scene, "scene file (TOML) whose structures get a DVH");
  list.add_output("--grid", options.grid, "NRRD file to write, total dose in Gy").needs(config);
  list.add_flag("--swelling", options.swelling,
                "the gland is swollen on the day of the implant, and healed 30 days later")
      .needs(config);
  list.add_flag("--what-if", options.what_if, "a session's seeds may be put into another scene than its own")
      .needs(seeds);
  list.add_force(options.force);
  list.add_flag("--json", options.json, "print the summary as JSON");
}

}  // namespace

Tool dose_tool() {
  return make_tool<DoseOptions>("dose", "Sum the dose of seeds at points, or over a scene's structures.",
                                R"(Examples:
  brachy dose --seeds S.csv --points P.csv --out O.csv
  brachy dose --seeds S.csv --config config/prostate.toml --grid dose.nrrd
  brachy dose --seeds S.csv --config config/prostate.toml --json
  brachy dose --seeds S.csv --config config/prostate.toml --swelling
  brachy dose --plan hdr.toml --config config/hdr.toml --json
Seeds: x,y,z,ax,ay,az,source,strength_u (axis of any length; the source's number: 6711, 200, 131, 192 or that
of the scene's dose.source). Points: x,y,z. mm. Of a plan of catheters the dose is the fraction's, the rate its mean.
Out: x,y,z,dose_rate_cgy_h,total_gy: the rate at implantation and the dose of the whole decay, the
exact sums of AAPM TG-43U1's line source in water. Inside a capsule: as on its surface, outwards.
--config: V100, D90 and the like of the scene's structures, of their part that lies in a grid of its
[dose] spacing and margin about the prostate, within 0.05 % of the exact sum at the grid's points.
--grid writes it, in Gy, as 3D Slicer reads it.
--swelling: seeds and structures are as after 30 days; on day 0 the gland is wider by 1 %, deeper by 11 %
and longer by 8 %, and seeds and tissue come closer with every day.
Exit codes: 0 done, 2 bad input.)",
                                declare, run);
}

}  // namespace brachy
