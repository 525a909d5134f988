#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "apps/command_line/output_file.h"
#include "apps/import/case/case_picture.h"
#include "apps/import/case/imported_case.h"
#include "apps/import/case/staged_folder.h"
#include "apps/import/case/volume_nrrd.h"
#include "core/base/colour_text.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/version.h"
#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/hole_names.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/structures/anatomy.h"
#include "core/geometry/mesh_io/ply_writer.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_plan.h"
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

/// The role, where the scene would find another by the name.
std::string role_line(const ImportedStructure& structure) {
  const StructureRole named = role_of_name(structure.name).role;
  if (structure.role == named && !is_unique(named)) return {};
  return std::string("role = \"") + role_word(structure.role) + "\"\n";
}

std::string colour_line(const ImportedStructure& structure) {
  return structure.colour ? "colour = \"" + hex_text(*structure.colour) + "\"\n" : std::string();
}

/// What a scene has beside the patient's body.
enum class SceneOf { kBody, kPlan, kImplant };

/// What differs from the default. The source decides what is prescribed where no plan says it.
std::string seeds_section(const ImportedCase& imported, SceneOf of) {
  const SeedSettings usual;
  const std::vector<DoseSeed>& seeds = imported.seeds;
  if (of != SceneOf::kImplant && imported.plan && imported.plan->hdr) return {};
  std::string text;
  if (of == SceneOf::kPlan) text += "applicator = \"train\"\n";
  if (!seeds.empty() && seeds.front().source != usual.source &&
      std::ranges::all_of(seeds, [&](const DoseSeed& s) { return s.source == seeds.front().source; }))
    text += fmt::format("source = \"{}\"\n", to_string(seeds.front().source));
  if (of == SceneOf::kImplant && seeds.size() > static_cast<std::size_t>(usual.max_count))
    text += fmt::format("max_count = {}\n", seeds.size());
  return text.empty() ? text : "\n[seeds]\n" + text;
}

/// The body, and plan.toml, or seeds.csv as an implant that is there.
std::string scene_text(const ImportedCase& imported, SceneOf of) {
  const bool has_plan = of == SceneOf::kPlan;
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
  text += hole_names_toml(grid);
  if (has_plan) text += "\n[plan]\nfile = \"plan.toml\"\n";
  if (of == SceneOf::kImplant) {
    text += "\n[implant]\nseeds = \"seeds.csv\"\n";
  } else if (imported.plan && imported.plan->hdr) {
    text += fmt::format("\n[needle]\ncount = {}\n\n[implant]\nkind = \"hdr\"\n",
                        imported.plan->hdr->catheters.size());
  }
  text += seeds_section(imported, of);
  for (std::size_t s = 1; s < imported.structures.size(); ++s)
    text += "\n[[structure]]\nname = \"" + imported.structures[s].name + "\"\nfile = \"" +
            imported.structures[s].name + ".ply\"\n" + role_line(imported.structures[s]) +
            colour_line(imported.structures[s]);
  if (imported.echo_db_per_value)
    text += "\n[ultrasound]\non = true\nvolume = \"volume.nrrd\"\nvolume_db_per_value = " +
            exact_text(*imported.echo_db_per_value) + "\n";
  if (imported.volume) text += "\n[display]\nvolume = \"volume.nrrd\"\n";
  return text;
}

nlohmann::ordered_json report_of(const ImportedCase& imported) {
  nlohmann::ordered_json json = {{"brachy", version()},
                                 {"warnings", imported.warnings},
                                 {"frame", "patient RAS, mm"},
                                 {"taken", imported.taken}};
  const std::vector<StructurePlace> places = structure_places(as_structures(imported));
  const auto point = [](const Vec3& p) { return nlohmann::ordered_json{p.x(), p.y(), p.z()}; };
  for (std::size_t n = 0; n < imported.structures.size(); ++n) {
    const ImportedStructure& s = imported.structures[n];
    json["structures"].push_back(
        {{"name", s.name},
         {"name_in_file", s.file_name},
         {"role", role_word(s.role)},
         {"from", s.from},
         {"colour", s.colour ? nlohmann::ordered_json(hex_text(*s.colour)) : nlohmann::ordered_json()},
         {"source_cc", s.source_cc},
         {"surface_cc", s.surface_cc},
         {"centroid_mm", point(places[n].centroid)},
         {"min_mm", point(places[n].min)},
         {"max_mm", point(places[n].max)},
         {"side", places[n].side},
         {"vertices", s.mesh.vertices.size()},
         {"notes", s.notes}});
  }
  if (imported.plan && imported.plan->hdr)
    json["plan"] = {{"catheters", imported.plan->hdr->catheters.size()},
                    {"dwells", imported.plan->hdr->dwell_count()},
                    {"dwell_positions", imported.plan->hdr->dwells(imported.grid).size()},
                    {"source", to_string(imported.plan->hdr->source)},
                    {"source_strength_u", imported.plan->hdr->source_strength_u},
                    {"total_reference_air_kerma_ugy",
                     imported.plan->hdr->source_strength_u * imported.plan->hdr->total_s() / 3600},
                    {"notes", imported.plan->notes}};
  else if (imported.plan)
    json["plan"] = {{"needles", imported.plan->plan.needles.size()},
                    {"seeds", imported.plan->plan.seed_count()},
                    {"air_kerma_strength_u", imported.plan->plan.air_kerma_strength_u},
                    {"seeds_moved_mm", imported.plan->most_moved_mm},
                    {"notes", imported.plan->notes}};
  if (!imported.seeds.empty()) json["seeds"] = imported.seeds.size();
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

std::string hex_text(const std::array<double, 3>& colour) {
  const auto byte = [&](std::size_t n) { return static_cast<std::uint8_t>(std::lround(255 * colour[n])); };
  return colour_text(Rgb{byte(0), byte(1), byte(2)});
}

std::string report_text(const ImportedCase& imported) {
  return report_of(imported).dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string places_text(const ImportedCase& imported) {
  const std::vector<StructurePlace> places = structure_places(as_structures(imported));
  std::string text = fmt::format("  {:<18} {:<16} {:>9} {:>9}  {:<24} {:<18} {}\n", "structure", "role", "cc",
                                 "in file", "centroid, RAS mm", "extent, mm", "lies");
  for (std::size_t n = 0; n < places.size(); ++n) {
    const ImportedStructure& s = imported.structures[n];
    const Vec3 &c = places[n].centroid, size = places[n].max - places[n].min;
    text +=
        fmt::format("  {:<18} {:<16} {:>9.2f} {:>9.2f}  {:<24} {:<18} {}\n", s.name, role_word(s.role),
                    s.surface_cc, s.source_cc, fmt::format("{:.1f} {:.1f} {:.1f}", c.x(), c.y(), c.z()),
                    fmt::format("{:.0f} × {:.0f} × {:.0f}", size.x(), size.y(), size.z()), places[n].side);
    for (const std::string& note : s.notes) text += "    " + note + "\n";
  }
  return text;
}

void write_case(const ImportedCase& imported, const std::filesystem::path& folder, bool force) {
  std::error_code none;
  if (!force && std::filesystem::is_directory(folder, none) && !std::filesystem::is_empty(folder))
    throw UserError(folder.string() + ": is not empty; choose another --out, or give --force");
  StagedFolder staged(folder);
  const std::filesystem::path& stage = staged.stage();
  for (const ImportedStructure& structure : imported.structures)
    write_ply(stage / (structure.name + ".ply"), structure.mesh);
  if (imported.plan)
    write_text(stage / "plan.toml", imported.plan->hdr ? to_toml(*imported.plan->hdr, imported.grid)
                                                       : to_toml(imported.plan->plan, imported.grid));
  if (!imported.seeds.empty()) write_text(stage / "seeds.csv", to_csv(imported.seeds));
  if (imported.dose) write_text(stage / "dose.nrrd", to_nrrd(*imported.dose, "dose", "Gy"));
  if (imported.volume) write_text(stage / "volume.nrrd", to_nrrd(*imported.volume, "image", ""));
  write_text(stage / "scene.toml", scene_text(imported, imported.plan ? SceneOf::kPlan : SceneOf::kBody));
  // The same with the plan that `brachy plan --generate` will write.
  if (!imported.plan) write_text(stage / "session.toml", scene_text(imported, SceneOf::kPlan));
  if (!imported.seeds.empty()) write_text(stage / "implant.toml", scene_text(imported, SceneOf::kImplant));
  write_text(stage / "import.json", report_text(imported));
  write_text(stage / "import.svg", picture_svg(imported));
  // What was written is what the other programs will read.
  const Scene scene = load_scene(stage / "scene.toml");
  const std::vector<Structure> structures = load_structures(scene);
  if (imported.echo_db_per_value) (void)load_echo_map(scene, structures);
  if (!imported.seeds.empty()) (void)load_seeds_at_start(load_scene(stage / "implant.toml"));
  if (imported.plan && imported.plan->hdr)
    (void)load_hdr_plan(stage / "plan.toml", scene.template_grid, scene.needle.length_mm);
  else if (imported.plan)
    (void)load_plan(stage / "plan.toml", scene.template_grid, scene.needle.length_mm);
  staged.publish();
}

}  // namespace brachy
