#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "net/broker/broker_options.h"
#include "net/wire/byte_io.h"

namespace brachy::net {

/// One connection to a NATS server, until it is lost. nats_link.cpp is the only file that includes libnats, and uses
/// none of its callbacks. libnats makes threads of its own; no code of this project runs on them.
/// Threads: one, which may block in any call for the times stated.
class NatsLink {
 public:
  static constexpr std::chrono::milliseconds kConnectTimeout{1000};
  /// A publish that cannot be written within it closes the connection.
  static constexpr std::chrono::milliseconds kWriteTimeout{1000};
  /// Limit of received messages not yet taken by next(): beyond it newer ones are lost.
  static constexpr int kMaxPendingBytes = 64 << 20;

  /// Connects, and subscribes to `subject`. Throws std::runtime_error: the broker does not answer, or refuses the
  /// connection.
  NatsLink(const BrokerOptions& options, const std::string& subject);
  ~NatsLink();
  NatsLink(const NatsLink&) = delete;
  NatsLink& operator=(const NatsLink&) = delete;

  bool is_up() const;               ///< false: lost for good, make another
  std::size_t max_payload() const;  ///< bytes of one message, as the broker says
  /// False: not sent.
  bool publish(const std::string& subject, std::span<const std::byte> payload);
  /// The next message; waits at most this long. nullopt: none arrived, or the link is lost.
  std::optional<Bytes> next(std::chrono::milliseconds wait);

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
};

}  // namespace brachy::net
