#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

namespace brachy {

/// Whether the deformation loop ticks, from the ticks that another thread has seen. Reads no clock: times are monotonic, ns.
/// Threads: one.
class LoopPulse {
 public:
  /// A loop that has not begun a tick for so long stands still: ten periods, but no less than a second.
  static constexpr std::int64_t kLeastSilenceNs = 1'000'000'000;

  LoopPulse(double period_s, std::int64_t now_ns)
      : most_silence_ns_(std::max(kLeastSilenceNs, static_cast<std::int64_t>(10e9 * period_s))),
        last_ns_(now_ns),
        told_ns_(now_ns) {}

  /// A tick that began then was published.
  void see(std::int64_t start_ns) { last_ns_ = std::max(last_ns_, start_ns); }

  /// Whether there were ticks since this was last asked.
  bool has_ticked() { return std::exchange(told_ns_, last_ns_) != last_ns_; }

  /// "" or that it stands still.
  std::string failure(std::int64_t now_ns) const {
    const std::int64_t silence_ns = now_ns - last_ns_;
    if (silence_ns <= most_silence_ns_) return {};
    return fmt::format("the deformation loop has not ticked for {:.1f} s",
                       1e-9 * static_cast<double>(silence_ns));
  }

 private:
  std::int64_t most_silence_ns_;
  std::int64_t last_ns_;  // newest tick
  std::int64_t told_ns_;  // newest at has_ticked()
};

}  // namespace brachy
