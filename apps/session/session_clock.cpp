#include "apps/session/session_clock.h"

#include <algorithm>

#include "core/base/number_csv.h"

namespace brachy {

SessionClock SessionClock::parse(std::string_view text, const std::string& name) {
  NumberCsvLimits limits;
  limits.may_be_empty = true;
  const NumberTable table = parse_number_csv(text, name, kSessionClockHeader, limits);
  SessionClock clock;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const double t_s = table.row(i)[0], wall_s = table.row(i)[1];
    if (i > 0 && !(t_s > clock.session_s_.back() && wall_s > clock.wall_s_.back()))
      refuse_line(name, table.lines[i], "a time goes back; sort the rows");
    clock.session_s_.push_back(t_s);
    clock.wall_s_.push_back(wall_s);
  }
  return clock;
}

double SessionClock::wall_s(double t_s) const {
  if (session_s_.empty()) return t_s;
  const auto after = std::ranges::upper_bound(session_s_, t_s) - session_s_.begin();
  const auto n = static_cast<std::size_t>(after);
  if (n == 0) return wall_s_.front() + (t_s - session_s_.front());
  if (n == session_s_.size()) return wall_s_.back() + (t_s - session_s_.back());
  const double share = (t_s - session_s_[n - 1]) / (session_s_[n] - session_s_[n - 1]);
  return wall_s_[n - 1] + share * (wall_s_[n] - wall_s_[n - 1]);
}

double SessionClock::missed_share() const {
  if (session_s_.size() < 2) return 0;
  const double wall = wall_s_.back() - wall_s_.front(), session = session_s_.back() - session_s_.front();
  return wall > session ? 1 - session / wall : 0;
}

}  // namespace brachy
