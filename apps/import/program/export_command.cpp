#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/import/case/case_structures.h"
#include "apps/import/case/volume_nrrd.h"
#include "apps/import/dicom_out/rt_objects.h"
#include "apps/terminal/progress.h"
#include "core/base/colour_text.h"
#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_nrrd.h"
#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "core/geometry/label_map/rasterise.h"
#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_check.h"
#include "core/geometry/volume/file_bytes.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

struct ExportLine {
  std::filesystem::path dicom, scene;
  std::optional<std::filesystem::path> plan, seeds, study;
  std::vector<std::string> surfaces;
  double slice_mm = 0.25;
  std::string dose_bits = "16";
  std::string date = "20000101";
  bool force = false;
};

/// All structures on the dose grid's points, a layer each.
LabelMap label_map_of(const std::vector<Structure>& structures, const std::vector<Rgb>& colours,
                      double spacing_mm) {
  Vec3 min = Vec3::Constant(1e9), max = -min;
  for (const Structure& s : structures)
    for (const Vec3& v : s.mesh.vertices) {
      min = min.cwiseMin(v);
      max = max.cwiseMax(v);
    }
  LabelMap map;
  map.grid.steps = Vec3::Constant(spacing_mm).asDiagonal();
  map.grid.origin = (min / spacing_mm).array().floor() * spacing_mm;
  for (int a = 0; a < 3; ++a)
    map.grid.size[static_cast<std::size_t>(a)] =
        static_cast<std::size_t>(std::ceil((max[a] - map.grid.origin[a]) / spacing_mm)) + 1;
  for (std::size_t n = 0; n < structures.size(); ++n) {
    auto& labels = map.layers.emplace_back(map.grid.count(), std::uint16_t{0});
    rasterise(SurfaceBvh(structures[n].mesh), map.grid, 1, labels);
    const auto [r, g, b] = colours[n];
    map.segments.push_back({structures[n].shown_name(), 1, n, {{r / 255.0, g / 255.0, b / 255.0}}});
  }
  return map;
}

/// The scene's, or where a structure has none one of its own.
std::vector<Rgb> colours_of(const std::vector<Structure>& structures, const Scene& scene) {
  std::vector<Rgb> colours;
  for (std::size_t n = 0; n < structures.size(); ++n) {
    const auto own = std::ranges::find(scene.structures, structures[n].name, &StructureSettings::name);
    const auto rgb = colour_from(n == 0                          ? scene.tissue.colour
                                 : own == scene.structures.end() ? std::string()
                                                                 : own->colour);
    colours.push_back(rgb ? *rgb : distinct_colour(n));
  }
  return colours;
}

/// "prostate=deformed.ply": a surface in place of the one at rest.
void replace_surface(std::vector<Structure>& structures, const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos) throw UsageError("--surface " + text + ": must be NAME=FILE");
  const std::string name = text.substr(0, equals), file = text.substr(equals + 1);
  const Structure* found = find_structure(structures, name);
  if (!found) throw UserError("--surface " + text + ": the scene has no structure \"" + name + "\"");
  PreparedSurface prepared = prepare_surface(read_mesh_file(file), {}, file);
  require_closed(prepared.report, file);
  structures[static_cast<std::size_t>(found - structures.data())].mesh = std::move(prepared.mesh);
}

/// The scene's plan or the one that was named, of either kind, and its sources for the dose.
struct ExportedPlan {
  std::optional<Plan> permanent;
  std::optional<HdrPlan> hdr;
  std::string text;
  std::vector<DoseSeed> seeds;
  bool is_empty() const { return !permanent && !hdr; }
};

ExportedPlan plan_of(const ExportLine& line, const Scene& scene) {
  ExportedPlan plan;
  if (!line.plan && scene.plan_file.empty()) return plan;
  const std::filesystem::path file = line.plan ? *line.plan : scene.resolve(scene.plan_file);
  constexpr std::size_t kMostPlanBytes = std::size_t{1} << 20;
  const TemplateGrid& grid = scene.template_grid;
  if (scene.implant.is_hdr() || is_hdr_plan(file_bytes(file, kMostPlanBytes))) {
    plan.hdr = load_hdr_plan(file, grid, scene.needle.length_mm);
    plan.text = to_toml(*plan.hdr, grid);
    plan.seeds = plan.hdr->seeds(grid);
  } else {
    plan.permanent = load_plan(file, grid, scene.needle.length_mm);
    plan.text = to_toml(*plan.permanent, grid);
    for (const PlannedSeed& seed : plan.permanent->seeds(grid)) plan.seeds.push_back(seed);
  }
  return plan;
}

int run(const ExportLine& line) {
  const Scene scene = load_scene(line.scene);
  std::vector<Structure> structures = load_structures(scene);
  for (const std::string& text : line.surfaces) replace_surface(structures, text);
  const ExportedPlan plan = plan_of(line, scene);
  std::vector<DoseSeed> seeds = plan.seeds;
  if (line.seeds) seeds = at_rest(load_seeds_in_place(*line.seeds));
  std::error_code ignored;
  std::filesystem::create_directories(line.dicom, ignored);
  if (!std::filesystem::is_directory(line.dicom))
    throw UserError(line.dicom.string() + ": cannot be made; choose another --dicom");
  if (!line.force && !std::filesystem::is_empty(line.dicom))
    throw UserError(line.dicom.string() + ": is not empty; choose another --dicom, or give --force");

  std::string content = scene.name + plan.text + line.date;
  for (const Structure& s : structures) {
    content += s.name;
    for (const Vec3& v : s.mesh.vertices)
      content.append(reinterpret_cast<const char*>(v.data()), 3 * sizeof(double));
  }
  for (const DoseSeed& s : seeds)
    content.append(reinterpret_cast<const char*>(s.position.data()), 3 * sizeof(double));
  ExportIds ids = make_ids(content, plain_name(scene.name, "scene"), line.date);
  if (line.study) take_study(*line.study, ids);
  const std::vector<Rgb> colours = colours_of(structures, scene);
  Progress progress("export");
  progress.show(0, "structures");
  write_rt_structure(line.dicom / "rtstruct.dcm", ids, structures, colours, line.slice_mm,
                     plan.hdr ? &*plan.hdr : nullptr);
  write_text(line.dicom / "structures.seg.nrrd",
             to_seg_nrrd(label_map_of(structures, colours, scene.dose.spacing_mm)), line.force);
  std::string written = "rtstruct.dcm, structures.seg.nrrd";
  if (!plan.is_empty()) {
    if (plan.hdr)
      write_rt_plan(line.dicom / "rtplan.dcm", ids, *plan.hdr, scene.template_grid, structures.size());
    else
      write_rt_plan(line.dicom / "rtplan.dcm", ids, *plan.permanent, scene.template_grid);
    written += ", rtplan.dcm";
  }
  if (!seeds.empty()) {
    progress.show(0.5, "dose");
    ImplantDose dose(structures, scene.dose);
    for (const DoseSeed& seed : seeds) dose.add(seed);
    write_rt_dose(line.dicom / "rtdose.dcm", ids, dose.grid(), !plan.is_empty(), std::stoi(line.dose_bits));
    write_text(line.dicom / "dose.nrrd", to_nrrd(dose.grid()), line.force);
    written += ", rtdose.dcm, dose.nrrd";
  }
  progress.finish();
  std::cout << fmt::format("export: {}: {}\n", line.dicom.string(), written);
  return kExitOk;
}

void declare(OptionList& list, ExportLine& line) {
  list.add_output_folder("--dicom", line.dicom, "folder to write; created if missing, must be empty")
      .required();
  list.add("--config", line.scene, "scene file (TOML)").required();
  list.add("--plan", line.plan, "plan (TOML or CSV) in place of the scene's");
  list.add("--seeds", line.seeds, "CSV of seeds as they lie, for the dose in place of the plan's");
  list.add("--surface", line.surfaces,
           "NAME=FILE: a deformed surface (PLY, STL) of a structure; may be repeated");
  list.add("--study", line.study,
           "a DICOM file of the patient, as the imported RTSTRUCT: the export belongs to its patient, study "
           "and frame "
           "of reference");
  list.add("--slice-mm", line.slice_mm, "between contours").range(0.1, 20.0).show_default();
  list.add("--dose-bits", line.dose_bits, "of a voxel of rtdose.dcm: 16, which every reader takes, or 32")
      .one_of({"16", "32"})
      .show_default();
  list.add("--date", line.date, "YYYYMMDD at which the seeds have their strength").show_default();
  list.add_flag("--force", line.force, "write into a folder that is not empty");
}

}  // namespace

Tool export_dicom_tool() {
  return make_tool<ExportLine>("export", "Write a scene and its plan as DICOM RT files and NRRD.",
                               R"(Examples:
  brachy export --dicom out/dicom --config config/session.toml
  brachy export --dicom out/dicom --config patient/scene.toml --plan patient/plan.toml --slice-mm 1
  brachy export --dicom out/dicom --config patient/session.toml --study export_of_planning_system/RS.dcm
  brachy export --dicom out/dicom --config config/session.toml --surface prostate=deformed.ply --seeds seeds.csv
Writes rtstruct.dcm, and structures.seg.nrrd for 3D Slicer; with a plan rtplan.dcm (an application setup for each
needle, a channel for each seed; of an HDR plan a channel for each catheter, with its dwells); with seeds or dwells
rtdose.dcm and dose.nrrd, the total dose on the grid of [dose]. UIDs come from the content: the same export has the
same bytes. The patient is called as the scene is; with --study FILE all objects belong to that file's patient, study
and frame of reference, so that a planning system shows them on the patient's images. Structures keep their colours.
Exit codes: 0 done, 1 the disk failed, 2 bad input.)",
                               declare, run);
}

}  // namespace brachy
