#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

namespace brachy {

/// Whether the deformation loop ticks, judged from the ticks that another thread has received. Reads no
/// clock: times are monotonic, ns.
/// Threads: one.
class LoopPulse {
 public:
  /// A loop that has not begun a tick for this long is stalled: ten periods, but no less than a second.
  static constexpr std::int64_t kLeastSilenceNs = 1'000'000'000;

  LoopPulse(double period_s, std::int64_t now_ns)
      : most_silence_ns_(std::max(kLeastSilenceNs, static_cast<std::int64_t>(10e9 * period_s))),
        last_ns_(now_ns),
        reported_ns_(now_ns) {}

  /// A tick that began at `start_ns` was published.
  void on_tick(std::int64_t start_ns) { last_ns_ = std::max(last_ns_, start_ns); }

  /// Whether there were ticks since the last call.
  bool has_ticked() { return std::exchange(reported_ns_, last_ns_) != last_ns_; }

  /// "" or a message that it is stalled.
  std::string failure(std::int64_t now_ns) const {
    const std::int64_t silence_ns = now_ns - last_ns_;
    if (silence_ns <= most_silence_ns_) return {};
    return fmt::format("the deformation loop has not ticked for {:.1f} s",
                       1e-9 * static_cast<double>(silence_ns));
  }

 private:
  std::int64_t most_silence_ns_;
  std::int64_t last_ns_;      // newest tick
  std::int64_t reported_ns_;  // newest at has_ticked()
};

}  // namespace brachy
