#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/realtime/deadline.h"
#include "net/session/rate_limit.h"

namespace brachy {

/// The rate-limited log for events that peers cause: a burst of kBurst lines is written, then kPerS a second;
/// the next line written is preceded by the number omitted. Lines about safety are outside this budget.
/// Characters that the protocol forbids in text (control characters) are removed from its lines. Threads: the
/// io thread.
class NetworkLog {
 public:
  static constexpr double kPerS = 5, kBurst = 200;

  enum class Level { kInfo, kWarning, kSafety };
  using Out = std::function<void(Level, const std::string&)>;

  /// `clock` outlives this.
  explicit NetworkLog(Clock& clock);  ///< to the program's log
  NetworkLog(Clock& clock, Out out) : clock_(clock), out_(std::move(out)) {}

  void info(const std::string& line) { write(Level::kInfo, line); }
  void warn(const std::string& line) { write(Level::kWarning, line); }
  /// A line about safety: never omitted. Its caller bounds their number (SafetyNotices).
  void safety(const std::string& line);
  void end();  ///< logs how many lines were omitted last

 private:
  void write(Level level, const std::string& line);

  Clock& clock_;
  Out out_;
  net::RateLimit rate_{kPerS, kBurst};
  std::uint64_t left_out_ = 0;
};

}  // namespace brachy
