#pragma once

#include <spdlog/sinks/base_sink.h>

#include <mutex>
#include <string_view>

#include "apps/daemon/service/non_blocking_stderr.h"

namespace brachy {

/// The name of the logger whose lines are about safety. Where there is none, they go to the default one.
inline constexpr const char* kSafetyLogger = "safety";

/// The program's log on a NonBlockingStderr. Lines of the logger kSafetyLogger wait for a reader that stalled; flush()
/// writes them once it goes on. Threads: any; spdlog's base class locks.
class StderrSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit StderrSink(NonBlockingStderr& err) : err_(err) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    const std::string_view text(line.data(), line.size());
    if (std::string_view(message.logger_name.data(), message.logger_name.size()) == kSafetyLogger)
      err_.write_safety(text);
    else
      err_.sputn(text.data(), static_cast<std::streamsize>(text.size()));
  }
  void flush_() override { err_.update(); }

  NonBlockingStderr& err_;
};

}  // namespace brachy
