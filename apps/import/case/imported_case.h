#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/import/case/case_plan.h"
#include "apps/import/voxels/voxel_volume.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

struct ImportedStructure {
  std::string name;       ///< 1 to 32 letters, digits, _ and -; once
  std::string file_name;  ///< as the file has it; may be empty
  std::string from;       ///< "ROI 3", "label 2": without a name, which could be a person's
  std::optional<std::array<double, 3>> colour;
  SurfaceMesh mesh;       ///< closed, outward; mm, RAS
  double source_cc = 0;   ///< volume of the voxels or slabs
  double surface_cc = 0;  ///< volume of the mesh
  std::vector<std::string> notes;
  StructureRole role = StructureRole::kOther;
  /// Why it could not be read, as an error's text: stops the import where it is the gland, and is left else.
  std::string fault;
  std::size_t file = 0;  ///< its number, from 1 on
};

/// A structure of points or open contours: a catheter.
struct ImportedCourse {
  int roi = 0;               ///< its number in the structure set
  std::string name;          ///< as the file has it
  std::vector<Vec3> points;  ///< at least two, in the file's order; mm, RAS
  std::string left;          ///< what to say where no plan has it
};

/// What was read from the files.
struct ImportedCase {
  std::vector<ImportedStructure> structures;  ///< the gland first
  std::vector<ImportedCourse> courses;        ///< those that the plan does not have, once it is read
  TemplateGrid grid;
  std::optional<CasePlan> plan;
  std::string plan_fault;                ///< why the first plan was not taken, as an error's text
  std::vector<RtPointDose> plan_points;  ///< doses that the plan states
  std::string plan_date, strength_date;  ///< YYYYMMDD, of the plan and its source's strength; empty: not said
  std::vector<DoseSeed> seeds;  ///< of the permanent implant, where the file has them; with or without a plan
  std::optional<VoxelVolume> dose, volume;
  std::string volume_modality;  ///< CT, MR, US, PT
  /// Of the volume's values, where they are the echoes that the scene's ultrasound shows.
  std::optional<double> echo_db_per_value;
  std::vector<std::string> warnings;              ///< what contradicts anatomy, or may be lost; one line each
  std::vector<std::string> taken, left, dropped;  ///< one line each; dropped: tags
  std::vector<std::string> files;  ///< their paths: "file 3 of 12" is files[2]; for the terminal alone
  std::vector<std::pair<std::string, std::string>> identifiers;  ///< empty unless asked for
};

struct ImportOptions {
  std::vector<std::string> inputs;  ///< files and folders
  std::string gland;                ///< name of the structure that is the gland; empty: by its name
  std::vector<std::string>
      roles;  ///< "rectum=NAME": names of structures by their roles; others by their names
  std::vector<std::string> leave, only;  ///< names of structures, as in the file or as in the scene
  bool needs_structure = true;           ///< a case without one is an error
  std::string source;                    ///< name of the temporary source of a plan; empty: by the file
  double tolerance_mm = 0.02;            ///< of the simplified surfaces
  std::size_t most_vertices = 6000;      ///< of a surface: beyond, the tolerance grows
  bool keep_identifiers = false;
};

/// A structure's colour as "#rrggbb".
std::string hex_text(const std::array<double, 3>& colour);

/// The structures as plans and scores will know them: those of unique roles by role_word.
std::vector<Structure> as_structures(const ImportedCase& imported);

/// Of each structure volume here and in the file, centroid, extent and side, as lines of a table.
std::string places_text(const ImportedCase& imported);

/// The text of import.json.
std::string report_text(const ImportedCase& imported);

/// Reads everything. `progress(share, what)`. Errors: UserError, one line with file, tag and fix.
ImportedCase read_case(const ImportOptions& options,
                       const std::function<void(double, const std::string&)>& progress);

/// Writes scene.toml, a PLY for each structure, plan.toml, seeds.csv, implant.toml, dose.nrrd, volume.nrrd,
/// import.json and import.svg, and loads the scene again as brachyd would. The files appear together, or none does.
/// The same case gives the same bytes. Errors: UserError where a file cannot be written, or one is there already,
/// unless `force`.
void write_case(const ImportedCase& imported, const std::filesystem::path& folder, bool force);

}  // namespace brachy
