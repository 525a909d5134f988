#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "apps/command_line/output_file.h"
#include "apps/import/case/imported_case.h"
#include "apps/import/case/staged_folder.h"
#include "apps/import/case/volume_nrrd.h"
#include "core/base/colour_text.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/version.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/geometry/mesh_io/ply_writer.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_structures.h"
#include "core/scene/load_ultrasound.h"

namespace brachy {
namespace {

struct CaseBox {
  Vec3 min = Vec3::Constant(1e9), max = Vec3::Constant(-1e9);
};

CaseBox box_of(const SurfaceMesh& mesh) {
  CaseBox box;
  for (const Vec3& v : mesh.vertices) {
    box.min = box.min.cwiseMin(v);
    box.max = box.max.cwiseMax(v);
  }
  return box;
}

std::string list_text(const Vec3& v) {
  return "[" + exact_text(v.x()) + ", " + exact_text(v.y()) + ", " + exact_text(v.z()) + "]";
}

std::string hex_text(const std::array<double, 3>& colour) {
  const auto byte = [&](std::size_t n) { return static_cast<std::uint8_t>(std::lround(255 * colour[n])); };
  return colour_text(Rgb{byte(0), byte(1), byte(2)});
}

std::string colour_line(const ImportedStructure& structure) {
  return structure.colour ? "colour = \"" + hex_text(*structure.colour) + "\"\n" : std::string();
}

/// `has_plan`: whether the session is by plan.toml.
std::string scene_text(const ImportedCase& imported, bool has_plan) {
  const ImportedStructure& gland = imported.structures.front();
  const CaseBox box = box_of(gland.mesh);
  const Vec3 size = (box.max - box.min + Vec3::Constant(46)).cwiseMax(96).array().ceil();
  const Vec3 centre = (10 * 0.5 * (box.min + box.max)).array().round() / 10;
  std::string text =
      "# Written by `brachy import`. Patient frame, RAS, mm; import.json says what came from where.\n"
      "name = \"imported\"\n\n[tissue]\nmesh = \"prostate.ply\"\n";
  // A surface of more than a third of the default's points gets an interior of its own.
  text += fmt::format("points = {}\n", std::max<std::size_t>(14560, 3 * gland.mesh.vertices.size()));
  text += colour_line(gland);
  text += "\n[box]\nsize_mm = " + list_text(size) + "\ncentre_mm = " + list_text(centre) + "\n";
  const TemplateGrid& grid = imported.grid;
  text += fmt::format("\n[template]\ncolumns = {}\nrows = {}\nspacing_mm = {}\norigin_mm = {}\n",
                      grid.columns, grid.rows, exact_text(grid.spacing_mm), list_text(grid.origin_mm));
  if (has_plan) text += "\n[plan]\nfile = \"plan.toml\"\n\n[seeds]\napplicator = \"train\"\n";
  for (std::size_t s = 1; s < imported.structures.size(); ++s)
    text += "\n[[structure]]\nname = \"" + imported.structures[s].name + "\"\nfile = \"" +
            imported.structures[s].name + ".ply\"\n" + colour_line(imported.structures[s]);
  if (imported.echo_db_per_value)
    text += "\n[ultrasound]\non = true\nvolume = \"volume.nrrd\"\nvolume_db_per_value = " +
            exact_text(*imported.echo_db_per_value) + "\n";
  if (imported.volume) text += "\n[display]\nvolume = \"volume.nrrd\"\n";
  return text;
}

nlohmann::ordered_json report_of(const ImportedCase& imported) {
  nlohmann::ordered_json json = {
      {"brachy", version()}, {"frame", "patient RAS, mm"}, {"taken", imported.taken}};
  for (const ImportedStructure& s : imported.structures)
    json["structures"].push_back(
        {{"name", s.name},
         {"from", s.from},
         {"colour", s.colour ? nlohmann::ordered_json(hex_text(*s.colour)) : nlohmann::ordered_json()},
         {"source_cc", s.source_cc},
         {"surface_cc", s.surface_cc},
         {"vertices", s.mesh.vertices.size()},
         {"notes", s.notes}});
  if (imported.plan)
    json["plan"] = {{"needles", imported.plan->plan.needles.size()},
                    {"seeds", imported.plan->plan.seed_count()},
                    {"air_kerma_strength_u", imported.plan->plan.air_kerma_strength_u},
                    {"seeds_moved_mm", imported.plan->most_moved_mm},
                    {"notes", imported.plan->notes}};
  json["dose"] = imported.dose ? nlohmann::ordered_json("dose.nrrd") : nlohmann::ordered_json();
  json["volume"] = imported.volume ? nlohmann::ordered_json("volume.nrrd") : nlohmann::ordered_json();
  if (imported.volume) {
    json["volume_modality"] = imported.volume_modality;
    json["volume_is_ultrasound"] = imported.echo_db_per_value.has_value();
  }
  json["left"] = imported.left;
  json["dropped"] = imported.dropped;
  if (!imported.identifiers.empty())
    for (const auto& [tag, value] : imported.identifiers) json["identifiers"][tag] = value;
  return json;
}

}  // namespace

void write_case(const ImportedCase& imported, const std::filesystem::path& folder, bool force) {
  std::error_code none;
  if (!force && std::filesystem::is_directory(folder, none) && !std::filesystem::is_empty(folder))
    throw UserError(folder.string() + ": is not empty; choose another --out, or give --force");
  StagedFolder staged(folder);
  const std::filesystem::path& stage = staged.stage();
  for (const ImportedStructure& structure : imported.structures)
    write_ply(stage / (structure.name + ".ply"), structure.mesh);
  if (imported.plan) write_text(stage / "plan.toml", to_toml(imported.plan->plan));
  if (imported.dose) write_text(stage / "dose.nrrd", to_nrrd(*imported.dose, "dose", "Gy"));
  if (imported.volume) write_text(stage / "volume.nrrd", to_nrrd(*imported.volume, "image", ""));
  write_text(stage / "scene.toml", scene_text(imported, imported.plan.has_value()));
  // The same with the plan that `brachy plan --generate` will write.
  if (!imported.plan) write_text(stage / "session.toml", scene_text(imported, true));
  write_text(stage / "import.json", report_of(imported).dump(1) + "\n");
  // What was written is what the other programs will read.
  const Scene scene = load_scene(stage / "scene.toml");
  const std::vector<Structure> structures = load_structures(scene);
  if (imported.echo_db_per_value) (void)load_echo_map(scene, structures);
  if (imported.plan) (void)load_plan(stage / "plan.toml", scene.template_grid, scene.needle.length_mm);
  staged.publish();
}

}  // namespace brachy
