#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/command_line/option_groups.h"
#include "apps/command_line/tool.h"
#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/surface/surface_check.h"
#include "haptics/trajectory/needle_metrics.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {
namespace {

struct MetricsOptions {
  std::filesystem::path trajectory, mesh;
  MeshFileFormat format;
  bool json = false;
};

SurfaceBvh load_tissue_surface(const MetricsOptions& options) {
  MeshFileOptions file;
  file.units = options.format.units == "m" ? MeshUnits::kM : MeshUnits::kMm;
  file.frame = options.format.frame == "LPS" ? MeshFrame::kLps : MeshFrame::kRas;
  const std::string name = options.mesh.string();
  PreparedSurface surface = prepare_surface(read_mesh_file(options.mesh, file), {}, name);
  require_closed(surface.report, name);
  return SurfaceBvh(std::move(surface.mesh));
}

nlohmann::ordered_json to_json(const NeedleMetrics& m) {
  return {{"poses", m.poses},
          {"elapsed_time_s", m.elapsed_time_s},
          {"path_length_mm", m.path_length_mm},
          {"path_in_tissue_mm", m.path_in_tissue_mm},
          {"time_in_tissue_s", m.time_in_tissue_s},
          {"passes", m.passes},
          {"speed_mm_s",
           {{"p50", m.speed_p50_mm_s},
            {"p90", m.speed_p90_mm_s},
            {"p95", m.speed_p95_mm_s},
            {"max", m.speed_max_mm_s}}}};
}

std::string number(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "–";
}

constexpr auto kColumns = "{:>6}{:>8}{:>10}{:>10}{:>13}{:>12}{:>8}{:>10}{:>7}{:>7}{:>7}\n";

std::string header() {
  const auto line = [](auto... cells) { return fmt::format(kColumns, cells...); };
  return line("needle", "poses", "elapsed", "path", "in tissue", "in tissue", "passes", "tip: p50", "p90",
              "p95", "max") +
         line("", "", "s", "mm", "mm", "s", "", "mm/s", "mm/s", "mm/s", "mm/s");
}

std::string row(const std::string& name, const NeedleMetrics& m) {
  return fmt::format(kColumns, name, m.poses, number(m.elapsed_time_s, 3), number(m.path_length_mm, 3),
                     number(m.path_in_tissue_mm, 3), number(m.time_in_tissue_s, 3), m.passes,
                     number(m.speed_p50_mm_s, 1), number(m.speed_p90_mm_s, 1), number(m.speed_p95_mm_s, 1),
                     number(m.speed_max_mm_s, 1));
}

int run(const MetricsOptions& options) {
  const NeedleTrajectories trajectories = load_trajectories(options.trajectory);
  const SurfaceBvh tissue = load_tissue_surface(options);
  const InsideTest inside = [&](const Vec3& p) { return tissue.inside(p); };

  NeedleMetricsTally all;
  auto needles = nlohmann::ordered_json::array();
  std::string rows;
  for (const auto& [id, motion] : trajectories.needles()) {
    const std::vector<TissueVisit> visits = tissue_visits(motion.samples(), inside);
    NeedleMetricsTally one;
    one.add(motion.samples(), visits);
    all.add(motion.samples(), visits);
    needles.push_back({{"needle", id}});
    needles.back().update(to_json(one.result()));
    rows += row(std::to_string(id), one.result());
  }
  if (options.json) {
    nlohmann::ordered_json json = to_json(all.result());
    json["needles"] = std::move(needles);
    std::cout << json.dump() << "\n";
    return kExitOk;
  }
  std::cout << header() << rows;
  if (trajectories.needles().size() > 1) std::cout << row("all", all.result());
  return kExitOk;
}

void declare(OptionList& list, MetricsOptions& options) {
  list.add("trajectory", options.trajectory, "CSV: t_s,m00,…,m23[,needle][,button] (X_WN, mm)").required();
  list.add("--mesh", options.mesh, "STL, OBJ or PLY of the tissue, closed").required();
  add_mesh_options(list, options.format);
  list.add_flag("--json", options.json, "print the metrics as JSON");
}

}  // namespace

Tool metrics_tool() {
  return make_tool<MetricsOptions>(
      "metrics", "Measure a needle trajectory against a tissue: times, paths, passes, speeds.",
      R"(Examples:
  brachy metrics out/run1/poses.csv --mesh prostate.stl
  brachy metrics tracked.csv --mesh tissue.stl --frame LPS --json
  brachy inspect config/prostate.toml --out gland.ply; brachy metrics t.csv --mesh gland.ply
As Perk Tutor defines them: a segment between two poses is in the tissue when its end is inside the closed
mesh; a pass is from outside to inside of the tip and of the points 1 mm before and behind it. Percentiles are
of the tip's speed over each segment. With several needles paths, times in tissue and passes add up.
Exit codes: 0 done, 2 bad input.)",
      declare, run);
}

}  // namespace brachy
