#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace brachy {

inline constexpr std::string_view kSessionClockHeader = "t_s,wall_s";

/// Where a session's time was on the clock of the trainee. Session time counts ticks: a machine that misses some of
/// them makes it slow, and hands in it fast.
class SessionClock {
 public:
  SessionClock() = default;  ///< shows session time
  /// Rows of kSessionClockHeader, both times increasing; may be none. Errors: UserError "name:line: what; fix".
  static SessionClock parse(std::string_view text, const std::string& name);

  /// Linear between rows, as fast as session time before and after them.
  double wall_s(double t_s) const;
  /// The session time of the last row; −∞: there is none.
  double end_s() const {
    return session_s_.empty() ? -std::numeric_limits<double>::infinity() : session_s_.back();
  }
  /// The share of the wall's time that session time is short of, from the first row to the last; 0: none.
  double missed_share() const;

 private:
  std::vector<double> session_s_, wall_s_;
};

}  // namespace brachy
