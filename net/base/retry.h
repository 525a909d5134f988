#pragma once

#include <algorithm>
#include <cstdint>

namespace brachy::net {

/// When to reconnect to a broker or another server: half a second after a failure, then twice as long each time,
/// 8 s at most. One thread.
class ConnectRetry {
 public:
  static constexpr std::int64_t kFirstNs = 500'000'000, kLongestNs = 8'000'000'000;

  bool is_due(std::int64_t now_ns) const { return now_ns >= due_ns_; }
  /// Until it is due; 0: it is.
  std::int64_t wait_ns(std::int64_t now_ns) const { return std::max<std::int64_t>(0, due_ns_ - now_ns); }
  void connected() { wait_ns_ = kFirstNs; }
  void failed(std::int64_t now_ns) {
    due_ns_ = now_ns + wait_ns_;
    wait_ns_ = std::min(2 * wait_ns_, kLongestNs);
  }

 private:
  std::int64_t due_ns_ = 0, wait_ns_ = kFirstNs;
};

}  // namespace brachy::net
