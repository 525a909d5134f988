#pragma once

#include <iostream>

#include "apps/recording/recorded_motion.h"
#include "apps/recording/recording_file.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

/// The needles' motion of a trajectory file or of a recording, recognized by its first bytes. Remarks go to standard
/// error. Throws UserError as load_trajectories and load_recorded_motion.
inline NeedleTrajectories load_motion(const std::filesystem::path& file, ReplayedModel model,
                                      std::size_t needle_count = kMaxTrajectoryNeedles) {
  if (!is_recording_file(file)) {
    NeedleTrajectories trajectories = load_trajectories(file, needle_count);
    for (const std::string& doubt : doubts_about(trajectories))
      std::cerr << "brachy: " << file.string() << ": " << doubt << "\n";
    return trajectories;
  }
  RecordedMotion motion = load_recorded_motion(file, model, needle_count);
  for (const std::string& remark : motion.remarks)
    std::cerr << "brachy: " << file.string() << ": " << remark << "\n";
  return std::move(motion.trajectories);
}

}  // namespace brachy
