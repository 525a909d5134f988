#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/realtime/deadline.h"
#include "net/base/rate_limit.h"

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

  NetworkLog();  ///< to the program's log
  explicit NetworkLog(Out out) : out_(std::move(out)) {}

  void info(const std::string& line, std::int64_t now_ns = monotonic_ns()) {
    write(Level::kInfo, line, now_ns);
  }
  void warn(const std::string& line, std::int64_t now_ns = monotonic_ns()) {
    write(Level::kWarning, line, now_ns);
  }
  /// A line about safety: never omitted. Its caller bounds their number (SafetyNotices).
  void safety(const std::string& line);
  void end();  ///< logs how many lines were omitted last

 private:
  void write(Level level, const std::string& line, std::int64_t now_ns);

  Out out_;
  net::RateLimit rate_{kPerS, kBurst};
  std::uint64_t left_out_ = 0;
};

}  // namespace brachy
