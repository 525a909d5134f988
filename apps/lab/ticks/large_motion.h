#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/lab/comparators/compared_model.h"
#include "core/kernels/landmark_spread.h"
#include "core/scene/scene.h"

namespace brachy {

/// One folder of tests/reference/large_motion: a motion or load in levels, and the neo-Hookean solution of each.
struct LargeMotion {
  std::string name;   ///< of the folder
  Scene scene;        ///< the body
  bool is_by_forces;  ///< the needle's forces are given, not its motion

  std::vector<Vec3> landmarks;  ///< of the simulated needle, m, at rest, mm
  ComparedScene given;          ///< of a comparator; points: those of field.csv, then filler up to 14,560

  struct Level {
    double motion_mm = 0;  ///< by name; of forces 0: the whole load
    /// Of the m landmarks: displacements, mm, or forces, N (is_by_forces).
    std::vector<Vec3> displacements, forces;
    std::vector<LandmarkSpread> spreads;
    std::vector<Vec3> given_displacements;  ///< of the comparator's landmarks, mm; none with forces
    std::vector<Vec3> field;                ///< u at the first points, mm
  };
  std::vector<Level> levels;
};

/// Reads a folder. Errors: UserError names the file.
LargeMotion load_large_motion(const std::filesystem::path& folder);

}  // namespace brachy
