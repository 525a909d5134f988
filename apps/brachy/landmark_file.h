#pragma once

#include <string>
#include <vector>

#include "apps/options.h"

namespace brachy {

/// Landmarks of a file, n of each.
struct Landmarks {
  std::vector<Vec3> positions, displacements;  ///< mm
  std::vector<double> cores;                   ///< mm, 0: the rung's rule
  std::vector<double> supports;                ///< mm, of the paper's rule; empty without the column
  std::vector<std::size_t> lines;              ///< of the file
};

/// Reads options.landmarks; cores and supports of 0 take options'. Errors: UserError by line.
Landmarks load_landmarks(const DeformOptions& options);

/// Of landmarks nearer than `distance` mm, one place to the solver, the later goes if both say the same, which is printed;
/// if not, they contradict each other: throws Refused by line. `name`: of the file.
void merge_twins(Landmarks& landmarks, double distance, const std::string& name);

}  // namespace brachy
