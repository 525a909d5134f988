#pragma once

#include <string>
#include <vector>

#include <filesystem>
#include <optional>

#include "core/base/rigid_transform.h"

namespace brachy {

/// The landmarks of a file and the field by them.
struct LandmarkFieldOptions {
  std::filesystem::path landmarks;             ///< CSV
  std::optional<std::filesystem::path> scene;  ///< body and kernel; none: an unbounded solid
  std::string kernel;                          ///< empty: the scene's, or psi31
  std::optional<double> support_mm, poisson, shear_modulus_kpa, core_radius_mm;
};

/// Landmarks of a file, n of each.
struct Landmarks {
  std::vector<Vec3> positions, displacements;  ///< mm
  std::vector<double> cores;                   ///< mm, 0: the model's default
  std::vector<double> supports;    ///< mm, one per landmark as in the paper; empty without the column
  std::vector<std::size_t> lines;  ///< of the file
};

/// Reads options.landmarks; cores and supports of 0 are replaced by those of the options. Errors: UserError by line.
Landmarks load_landmarks(const LandmarkFieldOptions& options);

/// Of two landmarks nearer than `distance` mm, which coincide for the solver, the later one is removed if their
/// displacements agree, and this is printed; otherwise throws Refused by line. `name`: of the file.
void merge_duplicates(Landmarks& landmarks, double distance, const std::string& name);

}  // namespace brachy
