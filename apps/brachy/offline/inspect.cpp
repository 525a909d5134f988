#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/command_line/option_groups.h"
#include "apps/command_line/tool.h"
#include "apps/recording/recording_tally.h"
#include "apps/terminal/progress.h"
#include "core/brachytherapy/structures/anatomy.h"
#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/mesh_io/ply_writer.h"
#include "core/scene/choice/choice.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_structures.h"
#include "core/scene/load_tissue.h"

namespace brachy {
namespace {

struct InspectOptions {
  std::filesystem::path file;  ///< mesh, scene or recording
  MeshFileFormat format;
  double weld_tolerance_mm = 1e-4;
  double min_island_share = 0.01;
  std::optional<std::filesystem::path> out;  ///< PLY of the surface
  bool json = false, force = false;
};

struct Inspected {
  SurfaceReport report;
  SurfaceMesh mesh;
  std::size_t points = 0;
  std::optional<std::vector<Vec3>> anchors;  // of a scene with a closed surface: where they stand at rest
  std::vector<StructurePlace> structures;    // of such a scene
  std::vector<std::string> warnings;
};

Inspected inspect_scene(const std::filesystem::path& file) {
  const Scene scene = load_scene(file);
  PreparedSurface surface = load_surface(scene);
  // A surface that is not closed has no inside to fill; the report says so.
  const SurfaceReport& report = surface.report;
  if (!report.watertight) return {report, std::move(surface.mesh), report.vertices, {}, {}, {}};
  const Tissue tissue = load_tissue(scene).tissue;
  const Anchors anchors = load_anchors(with_choice(scene), tissue);
  const std::vector<Structure> structures = load_structures(scene);
  return {report,
          std::move(surface.mesh),
          tissue.size(),
          std::vector(anchors.positions().begin(), anchors.positions().end()),
          structure_places(structures),
          geometry_warnings(scene, structures)};
}

Inspected inspect_mesh(const InspectOptions& options) {
  MeshFileOptions file;
  file.units = options.format.units == "m" ? MeshUnits::kM : MeshUnits::kMm;
  file.frame = options.format.frame == "LPS" ? MeshFrame::kLps : MeshFrame::kRas;
  PreparedSurface surface =
      prepare_surface(read_mesh_file(options.file, file),
                      {options.weld_tolerance_mm, options.min_island_share}, options.file.string());
  const std::size_t vertices = surface.report.vertices;
  return {surface.report, std::move(surface.mesh), vertices, {}, {}, {}};
}

nlohmann::ordered_json to_json(const Inspected& i) {
  const SurfaceReport& r = i.report;
  const auto point = [](const Vec3& p) { return nlohmann::json{p.x(), p.y(), p.z()}; };
  nlohmann::ordered_json json = {{"surface_vertices", r.vertices},
                                 {"points", i.points},
                                 {"triangles", r.triangles},
                                 {"volume_cc", r.volume_cc},
                                 {"components", r.components},
                                 {"cavities", r.cavities},
                                 {"watertight", r.watertight},
                                 {"bad_edges", r.bad_edges},
                                 {"open_edges", r.open_edges},
                                 {"nonmanifold_edges", r.nonmanifold_edges},
                                 {"twisted_edges", r.twisted_edges},
                                 {"dropped_islands", r.dropped_islands},
                                 {"dropped_island_volume_cc", r.dropped_island_volume_cc},
                                 {"welded_vertices", r.welded_vertices},
                                 {"flipped_triangles", r.flipped_triangles},
                                 {"bbox_mm", nlohmann::json::array({point(r.min_mm), point(r.max_mm)})}};
  if (i.anchors) {
    auto anchors = nlohmann::json::array();
    for (const Vec3& anchor : *i.anchors) anchors.push_back(point(anchor));
    json["anchors_mm"] = anchors;
  }
  for (const StructurePlace& place : i.structures)
    json["structures"].push_back({{"name", place.name},
                                  {"role", role_word(place.role)},
                                  {"volume_cc", place.volume_cc},
                                  {"centroid_mm", point(place.centroid)},
                                  {"bbox_mm", nlohmann::json::array({point(place.min), point(place.max)})},
                                  {"side", place.side}});
  if (i.anchors) json["warnings"] = i.warnings;
  return json;
}

std::string to_text(const Inspected& i, const std::string& name) {
  const SurfaceReport& r = i.report;
  const Vec3 size = r.max_mm - r.min_mm;
  std::string text = fmt::format(
      "{}\n  {} points: {} surface vertices, {} interior; {} triangles\n"
      "  {} component(s), {} cavities; {}\n"
      "  {:.2f} cc; {:.1f} × {:.1f} × {:.1f} mm from ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, {:.1f})\n",
      name, i.points, r.vertices, i.points - r.vertices, r.triangles, r.components, r.cavities,
      r.watertight ? "watertight"
                   : fmt::format("NOT watertight: {} bad edges ({} open, {} non-manifold, {} twisted)",
                                 r.bad_edges, r.open_edges, r.nonmanifold_edges, r.twisted_edges),
      r.volume_cc, size.x(), size.y(), size.z(), r.min_mm.x(), r.min_mm.y(), r.min_mm.z(), r.max_mm.x(),
      r.max_mm.y(), r.max_mm.z());
  if (r.dropped_islands)
    text += fmt::format("  dropped: {} islands, {:.3g} cc together\n", r.dropped_islands,
                        r.dropped_island_volume_cc);
  if (r.welded_vertices || r.flipped_triangles)
    text += fmt::format("  repaired: {} vertices welded, {} triangles turned\n", r.welded_vertices,
                        r.flipped_triangles);
  for (const StructurePlace& place : i.structures) {
    const Vec3 &c = place.centroid, extent = place.max - place.min;
    text += fmt::format(
        "  {:<16} {:<12} {:>8.2f} cc; centroid {:.1f} {:.1f} {:.1f}; {:.0f} × {:.0f} × {:.0f} mm{}{}\n",
        place.name, role_word(place.role), place.volume_cc, c.x(), c.y(), c.z(), extent.x(), extent.y(),
        extent.z(), place.side.empty() ? "" : "; ", place.side);
  }
  for (const std::string& warning : i.warnings) text.insert(0, "WARNING: " + warning + "\n");
  return text;
}

int inspect_recording(const InspectOptions& options) {
  RecordingReader reader(options.file);
  RecordingTally tally;
  net::ServerMessages messages(tally.handlers());
  const auto bytes = static_cast<double>(std::filesystem::file_size(options.file));
  Progress progress("inspect");
  read_recording(reader, messages, [&] { progress.show(static_cast<double>(reader.offset()) / bytes); });
  progress.finish();
  if (options.json)
    std::cout << tally.to_json(reader.offset(), reader.damage());
  else
    std::cout << options.file.string() << "\n" << tally.to_text(reader.offset(), reader.damage());
  return kExitOk;
}

int run(const InspectOptions& options) {
  if (is_recording_file(options.file)) return inspect_recording(options);
  const bool is_scene = options.file.extension() == ".toml";
  const Inspected inspected = is_scene ? inspect_scene(options.file) : inspect_mesh(options);
  if (options.out) write_ply(*options.out, inspected.mesh);
  if (options.json)
    std::cout << to_json(inspected).dump() << "\n";
  else
    std::cout << to_text(inspected, options.file.string());
  return kExitOk;
}

void declare(OptionList& list, InspectOptions& options) {
  list.add("file", options.file, "STL, OBJ or PLY, a scene (.toml), or a recording").required();
  add_mesh_options(list, options.format);
  list.add("--weld-tolerance-mm", options.weld_tolerance_mm, "vertices closer than this are merged")
      .range(0.0, 1.0)
      .show_default();
  list.add("--min-island-share", options.min_island_share, "smaller islands are dropped")
      .range(0.0, 0.5)
      .show_default();
  list.add_output("--out", options.out, "also write the surface, welded and outward, as PLY");
  list.add_force(options.force);
  list.add_flag("--json", options.json, "print the report as JSON");
}

}  // namespace

Tool inspect_tool() {
  return make_tool<InspectOptions>("inspect", "Describe a mesh, a scene's tissue or a recording.",
                                   R"(Examples:
  brachy inspect prostate.stl
  brachy inspect config/prostate.toml --json
  brachy inspect run1.brachy                      a recording: length, rates, gaps, seeds, damage)",
                                   declare, run);
}

}  // namespace brachy
