#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/forces/force_log.h"
#include "apps/session/session_clock.h"
#include "apps/session/session_folder.h"
#include "core/brachytherapy/seeds/seed.h"

namespace brachy {

/// What an earlier run left in a session's directory.
struct EarlierSession {
  double end_s = 0;                                 ///< the latest time in poses, forces and ledger
  ForceColumns force_columns = ForceColumns::kAll;  ///< of its forces, which are continued with the same
  std::vector<Seed> seeds;                          ///< of the ledger
  std::vector<std::int32_t> lost;    ///< planned seeds that were lost: no longer in their needles
  bool has_unfinished_seed = false;  ///< the ledger ends within a row
  SessionClock clock;                ///< of the runs so far
  std::string missing_text;          ///< which files are missing or blank beside others; empty: none
};

/// Examines what the directory holds before anything in it is written, cut or created: every file of a session that is
/// there may be written (SessionFolder::check_all), tables have the right first line and a whole last row, and are not
/// there without the session that they belong to. What a killed process did not finish is left out.
/// Throws UserError that names the file and the fix.
EarlierSession examine_earlier_session(const SessionFolder& folder, const std::string& poses_header,
                                       std::size_t needle_count);

}  // namespace brachy
