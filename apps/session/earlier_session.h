#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/forces/force_log.h"
#include "core/brachytherapy/seeds/seed.h"

namespace brachy {

inline constexpr const char *kPosesFile = "poses.csv", *kForcesFile = "forces.csv", *kSeedsFile = "seeds.csv",
                            *kDropsFile = "drops.csv", *kContactsFile = "contacts.csv";

/// What an earlier run left in a session's directory.
struct EarlierSession {
  double end_s = 0;                                 ///< the latest time in poses, forces and ledger
  ForceColumns force_columns = ForceColumns::kAll;  ///< of its forces, which are continued with the same
  std::string missing_text;  ///< which files are missing or blank beside others; empty: none
};

/// Creates the directory, and checks what it holds before any of its files is opened for writing: each is a regular
/// file (a FIFO would block, a device take anything) with the right first line and a whole last row. A blank file is
/// emptied, a row that was not finished is cut off. The ledger's rows are checked by SeedLedger.
/// Throws UserError that names the file and the fix.
EarlierSession examine_earlier_session(const std::filesystem::path& folder, const std::string& poses_header,
                                       std::size_t needle_count);

/// The latest time of an earlier run's seeds, s; 0: none. Throws UserError for a time that is none.
double latest_seed_s(const std::vector<Seed>& seeds, const std::filesystem::path& file);

}  // namespace brachy
