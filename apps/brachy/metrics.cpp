#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/tools.h"
#include "core/mesh_io/mesh_file.h"
#include "core/surface/surface_bvh.h"
#include "core/surface/surface_check.h"
#include "haptics/trajectory/needle_metrics.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {
namespace {

SurfaceBvh load_tissue_surface(const MetricsOptions& options) {
  MeshFileOptions file;
  file.units = options.units == "m" ? MeshUnits::kM : MeshUnits::kMm;
  file.frame = options.frame == "LPS" ? MeshFrame::kLps : MeshFrame::kRas;
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

}  // namespace

int metrics(const MetricsOptions& options) {
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

}  // namespace brachy
