#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace brachy::net {

/// Limits the time that a thread spends on TLS handshakes, which peers cause at little cost of their own: `share` of it
/// on average, with bursts of kBurst. A handshake counts as kLeast or more: with a share of 2 % at most 100 a second
/// begin. What a key costs is measured: of one with RSA of 4,096 bits fewer begin. Threads: one.
class HandshakeLimit {
 public:
  static constexpr std::chrono::nanoseconds kBurst{40'000'000}, kLeast{200'000}, kMost{20'000'000};

  explicit HandshakeLimit(double share) : share_(share) {}

  /// Whether a handshake may begin now. If it does, spent() follows.
  bool may_begin(std::int64_t now_ns) {
    if (last_ns_ != 0 && now_ns > last_ns_)
      left_ns_ = std::min(left_ns_ + share_ * static_cast<double>(now_ns - last_ns_),
                          static_cast<double>(kBurst.count()));
    last_ns_ = now_ns;
    return left_ns_ > 0;
  }
  /// A handshake began, and its first step took this long; counted as kMost at most.
  void spent(std::int64_t ns) {
    left_ns_ -= static_cast<double>(std::clamp(ns, kLeast.count(), kMost.count()));
  }
  /// A later step, which is never put off: its peer has done its part.
  void spent_later(std::int64_t ns) {
    left_ns_ -= static_cast<double>(std::clamp(ns, std::int64_t{0}, kMost.count()));
  }

 private:
  const double share_;
  double left_ns_ = static_cast<double>(kBurst.count());
  std::int64_t last_ns_ = 0;
};

}  // namespace brachy::net
