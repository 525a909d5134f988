#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "apps/session/session_folder.h"

namespace brachy {

/// The states that a session's directory keeps of its run (Simulator::save), so that a replay can start in the middle:
/// a file for each, `states/SECONDS.bin`, by the session's time. Each has a checksum, and is complete or not there.
constexpr double kStatePeriodS = 10;  ///< one in so many seconds
/// The same in ticks.
inline std::uint64_t ticks_per_state(double period_s) {
  return static_cast<std::uint64_t>(std::llround(kStatePeriodS / period_s));
}

struct SessionState {
  double t_s = 0;  ///< of the session, after the tick
  std::vector<std::byte> bytes;
};

/// Errors: UserError with the file where it cannot be written.
void write_session_state(const SessionFolder& session, double t_s, std::span<const std::byte> bytes);

/// The newest that is not later than `t_s`. Errors: UserError where the session has none, or the file is damaged.
SessionState load_session_state(const SessionFolder& session, double t_s);

}  // namespace brachy
