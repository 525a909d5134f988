#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace brachy::net {

/// Limits the time that the io thread spends on TLS handshakes, since forces wait meanwhile: a peer makes it sign by
/// sending one ClientHello. kShare of the time on average, with bursts of kBurst; a handshake counts as kLeast or
/// more, so that at most 100 a second begin. What a key costs is measured: of one with RSA of 4,096 bits fewer begin.
/// Threads: the io thread.
class HandshakeLimit {
 public:
  static constexpr double kShare = 0.02;
  static constexpr std::chrono::nanoseconds kBurst{40'000'000}, kLeast{200'000}, kMost{20'000'000};

  /// Whether a handshake may begin now. If it does, spent() follows.
  bool may_begin(std::int64_t now_ns) {
    if (last_ns_ != 0 && now_ns > last_ns_)
      left_ns_ = std::min(left_ns_ + kShare * static_cast<double>(now_ns - last_ns_),
                          static_cast<double>(kBurst.count()));
    last_ns_ = now_ns;
    return left_ns_ > 0;
  }
  /// A handshake began, and its first step took this long; counted as kMost at most.
  void spent(std::int64_t ns) {
    left_ns_ -= static_cast<double>(std::clamp(ns, kLeast.count(), kMost.count()));
    ++begun_;
  }

  std::uint64_t begun() const { return begun_; }  ///< since start

 private:
  double left_ns_ = static_cast<double>(kBurst.count());
  std::int64_t last_ns_ = 0;
  std::uint64_t begun_ = 0;
};

/// What the first bytes of a TLS connection hold.
enum class ClientHello {
  kIncomplete,  ///< more must come
  kComplete,
  kBad,  ///< no ClientHello, or one in several records or over `most` bytes
};

/// A handshake begins only with a whole ClientHello: its costly first step is then done, and measured, in one call.
inline ClientHello find_client_hello(std::span<const std::byte> bytes, std::size_t most) {
  constexpr std::size_t kRecordHead = 5, kMessageHead = 4;
  const auto at = [&](std::size_t i) { return std::to_integer<std::size_t>(bytes[i]); };
  constexpr std::size_t kHandshakeRecord = 0x16, kClientHello = 1;
  if (!bytes.empty() && at(0) != kHandshakeRecord) return ClientHello::kBad;
  if (bytes.size() < kRecordHead + kMessageHead) return ClientHello::kIncomplete;
  const std::size_t record = at(3) << 8 | at(4), message = at(6) << 16 | at(7) << 8 | at(8);
  if (at(5) != kClientHello || record > most - kRecordHead || message + kMessageHead > record)
    return ClientHello::kBad;
  return bytes.size() < kRecordHead + record ? ClientHello::kIncomplete : ClientHello::kComplete;
}

}  // namespace brachy::net
