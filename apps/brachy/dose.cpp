#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/output_file.h"
#include "apps/brachy/tools.h"
#include "core/dose/dose_nrrd.h"
#include "core/dose/dose_rate.h"
#include "core/dose/dose_seed_file.h"
#include "core/dose/implant_dose.h"
#include "core/number_csv.h"
#include "core/scene/scene_file.h"
#include "core/structures/load_structures.h"

namespace brachy {
namespace {

struct PointDoses {
  std::size_t count = 0;
  double least_gy = 0, largest_gy = 0;
};

PointDoses write_point_doses(const std::vector<DoseSeed>& seeds, const DoseOptions& options) {
  const NumberTable points = load_number_csv(*options.points, "x,y,z");
  std::string text = "x,y,z,dose_rate_cgy_h,total_gy\n";
  PointDoses result{.count = points.rows()};
  for (std::size_t i = 0; i < points.rows(); ++i) {
    const Vec3 p(points.row(i)[0], points.row(i)[1], points.row(i)[2]);
    double rate = 0, total = 0;
    for (const DoseSeed& seed : seeds) {
      const double of_seed = dose_rate_cgy_h(seed, p);
      rate += of_seed;
      total += total_gy_per_cgy_h(seed.source) * of_seed;
    }
    append_csv_row(text, std::array{p.x(), p.y(), p.z(), rate, total});
    text += '\n';
    result.least_gy = i == 0 ? total : std::min(result.least_gy, total);
    result.largest_gy = std::max(result.largest_gy, total);
  }
  write_text(*options.out, text);
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
          {"d2cc_gy", dose.d2cc_gy}};  // null where there is none
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

}  // namespace

int dose(const DoseOptions& options) {
  check_folder_of(options.out);
  check_folder_of(options.grid);
  const std::vector<DoseSeed> seeds = load_dose_seeds(options.seeds);
  double strength_u = 0;
  for (const DoseSeed& seed : seeds) strength_u += seed.air_kerma_strength_u;
  nlohmann::ordered_json json = {{"seeds", seeds.size()}, {"strength_u", strength_u}};
  if (options.points) {
    const PointDoses points = write_point_doses(seeds, options);
    json["points"] = points.count;
    json["least_gy"] = points.least_gy;
    json["largest_gy"] = points.largest_gy;
    if (!options.json)
      std::cout << fmt::format("{}: {} seeds, {:.4g} U; at {} points {:.4g} … {:.4g} Gy\n",
                               options.out->string(), seeds.size(), strength_u, points.count, points.least_gy,
                               points.largest_gy);
  }
  if (options.scene) {
    const Scene scene = load_scene(*options.scene);
    ImplantDose implant(load_structures(scene), scene.dose);
    for (const DoseSeed& seed : seeds) implant.add(seed);
    if (options.grid) write_text(*options.grid, to_nrrd(implant.grid()));
    const std::vector<StructureDose> doses = implant.evaluate();
    json["prescription_gy"] = scene.dose.prescription_gy;
    for (const StructureDose& dose : doses) json["structures"].push_back(to_json(dose));
    if (!options.json) print_table(doses, scene.dose.prescription_gy);
  }
  if (options.json) std::cout << json.dump() << "\n";
  return kExitOk;
}

}  // namespace brachy
