#include "apps/daemon/network_log.h"

#include <spdlog/spdlog.h>

#include "apps/daemon/service/stderr_sink.h"
#include "net/wire/text.h"

namespace brachy {
namespace {

constexpr std::size_t kMaxLineBytes = 2048;

void to_program_log(NetworkLog::Level level, const std::string& line) {
  const auto safety_log = level == NetworkLog::Level::kSafety ? spdlog::get(kSafetyLogger) : nullptr;
  if (safety_log) return safety_log->warn("{}", line);
  spdlog::log(level == NetworkLog::Level::kInfo ? spdlog::level::info : spdlog::level::warn, "{}", line);
}

}  // namespace

NetworkLog::NetworkLog(Clock& clock) : NetworkLog(clock, to_program_log) {}

void NetworkLog::write(Level level, const std::string& line) {
  if (!rate_.pass(clock_.now_ns())) {
    ++left_out_;
    return;
  }
  end();
  out_(level, net::to_wire_text(line, kMaxLineBytes));
}

void NetworkLog::safety(const std::string& line) {
  out_(Level::kSafety, net::to_wire_text(line, kMaxLineBytes));
}

void NetworkLog::end() {
  if (left_out_ > 0)
    out_(Level::kWarning, std::to_string(left_out_) + " lines about the network left out: too many at once");
  left_out_ = 0;
}

}  // namespace brachy
