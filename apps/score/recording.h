#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/forces/force_log.h"
#include "core/seeds/seed.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

/// What a session left behind, as far as it can be read.
struct Recording {
  std::string name;                         ///< of the folder
  std::optional<NeedleTrajectories> poses;  ///< poses.csv: every tick's, of the device's needles
  std::vector<ForceSample> forces;          ///< forces.csv; empty: none
  std::optional<std::vector<Seed>> seeds;   ///< seeds.csv, in the order of falling
  std::vector<std::string> remarks;  ///< what is missing or cut off and what follows from it, a sentence each
};

/// Reads a recording's folder: poses.csv, forces.csv and seeds.csv. A file that is missing or cannot be read is left out,
/// and of one that ends within a line (its writer was killed) that line, with a remark. Throws UserError where there is no
/// such folder, or none of the files can be read.
Recording load_recording(const std::filesystem::path& folder);

}  // namespace brachy
