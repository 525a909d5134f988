#pragma once

#include <cstddef>
#include <span>

namespace brachy::net {

/// What the first bytes of a TLS connection hold.
enum class ClientHello {
  kIncomplete,  ///< more must come
  kComplete,
  kBad,  ///< no ClientHello, or one in several records or over `most` bytes
};

/// A handshake begins only with a whole ClientHello: its costly first step is then computed, and measured, at once.
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
