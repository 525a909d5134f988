#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/import/case/case_plan.h"
#include "apps/import/voxels/voxel_volume.h"
#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

struct ImportedStructure {
  std::string name;  ///< 1 to 32 letters, digits, _ and -; once
  std::string from;  ///< "ROI 3", "label 2": without a name, which could be a person's
  std::optional<std::array<double, 3>> colour;
  SurfaceMesh mesh;       ///< closed, outward; mm, RAS
  double source_cc = 0;   ///< volume of the voxels or slabs
  double surface_cc = 0;  ///< volume of the mesh
  std::vector<std::string> notes;
};

/// What was read from the files.
struct ImportedCase {
  std::vector<ImportedStructure> structures;  ///< the gland first
  TemplateGrid grid;
  std::optional<CasePlan> plan;
  std::optional<VoxelVolume> dose, volume;
  std::string volume_modality;  ///< CT, MR, US, PT
  /// Of the volume's values, where they are the echoes that the scene's ultrasound shows.
  std::optional<double> echo_db_per_value;
  std::vector<std::string> taken, left, dropped;                 ///< one line each; dropped: tags
  std::vector<std::pair<std::string, std::string>> identifiers;  ///< empty unless asked for
};

struct ImportOptions {
  std::vector<std::string> inputs;   ///< files and folders
  std::string gland;                 ///< name of the structure that is the gland; empty: by its name
  double tolerance_mm = 0.02;        ///< of the simplified surfaces
  std::size_t most_vertices = 6000;  ///< of a surface: beyond, the tolerance grows
  bool keep_identifiers = false;
};

/// Reads everything. `progress(share, what)`. Errors: UserError, one line with file, tag and fix.
ImportedCase read_case(const ImportOptions& options,
                       const std::function<void(double, const std::string&)>& progress);

/// Writes scene.toml, a PLY for each structure, plan.toml, dose.nrrd, volume.nrrd and import.json, and loads the scene
/// again as brachyd would. The files appear together, or none does. The same case gives the same bytes. Errors:
/// UserError where a file cannot be written, or one is there already, unless `force`.
void write_case(const ImportedCase& imported, const std::filesystem::path& folder, bool force);

}  // namespace brachy
