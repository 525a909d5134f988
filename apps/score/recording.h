#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/forces/force_log.h"
#include "apps/session/session_clock.h"
#include "apps/session/volume_study_file.h"
#include "core/brachytherapy/seeds/seed.h"
#include "core/brachytherapy/seeds/seed_drop.h"
#include "core/brachytherapy/structures/organ_pass_file.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {

/// What is used of a row of a force log: of a long session there are millions.
struct RecordedForce {
  double t_s = 0;
  std::uint32_t needle = 0;
  ContactState state = ContactState::kFree;
  double force_n = 0;  ///< the size of NeedleForces::force_n

  RecordedForce(const ForceSample& sample)  // implicit: it is a part of it
      : t_s(sample.t_s), needle(sample.needle), state(sample.state), force_n(sample.forces.force_n.norm()) {}
};

/// The files of a session, as far as they can be read. All times are the trainee's clock's where the session has one
/// (clock.csv), else session time.
struct Recording {
  std::string name;                         ///< of the directory, or of a file of seeds
  bool is_of_seeds_alone = false;           ///< nothing else is there to be known
  std::optional<NeedleTrajectories> poses;  ///< poses.csv, of the device's needles
  std::vector<RecordedForce> forces;        ///< forces.csv; empty: none
  std::optional<std::vector<Seed>> seeds;   ///< seeds.csv, in the order of dropping
  std::optional<std::vector<FailedDrop>>
      failed_drops;  ///< drops.csv; none: only the daemon and offline replays write it
  std::optional<std::vector<OrganPass>> passes;  ///< contacts.csv; the same
  std::vector<RecordedStudy> studies;            ///< volume_studies.jsonl; empty: none
  SessionClock clock;                ///< that all times above are of; for those that come from elsewhere
  std::vector<std::string> remarks;  ///< what is missing or truncated and its consequence, a sentence each
};

/// Reads a recording's directory: poses.csv, forces.csv and seeds.csv; drops.csv, contacts.csv, clock.csv and
/// volume_studies.jsonl where they are there. A file that is missing or unreadable is left
/// out, as is an incomplete last line (the writer was killed), with a remark. Throws UserError where there is no such
/// directory, none of the files can be read, or one is no regular file (session_folder.h).
Recording load_recording(const std::filesystem::path& folder);

/// An implant of which only the seeds are known, as after an import (load_seeds_in_place). Throws UserError.
Recording load_seeds_recording(const std::filesystem::path& file);

/// Without the probe, which is no needle: it is in the rectum all the time.
void leave_out(Recording& recording, std::uint32_t probe);

}  // namespace brachy
