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

/// One connection to a NATS server, until it is lost: nats_link.cpp is the only file that includes libnats, and none of its
/// callbacks is used. It makes threads of libnats'; nothing of ours runs on them.
/// Threads: one, which may wait in any call for as long as is said.
class NatsLink {
 public:
  static constexpr std::chrono::milliseconds kConnectTimeout{1000};
  /// A publish that is not rid of within it loses the connection.
  static constexpr std::chrono::milliseconds kWriteTimeout{1000};
  /// Of messages that came and were not taken by next(): older ones stay, newer ones are lost beyond it.
  static constexpr int kMaxPendingBytes = 64 << 20;

  /// Connects, and subscribes to `subject`. Throws std::runtime_error: the broker does not answer, or lets nobody in.
  NatsLink(const BrokerOptions& options, const std::string& subject);
  ~NatsLink();
  NatsLink(const NatsLink&) = delete;
  NatsLink& operator=(const NatsLink&) = delete;

  bool is_up() const;               ///< false: it is lost for good, make another
  std::size_t max_payload() const;  ///< bytes of one message, as the broker says
  /// False: it was not sent.
  bool publish(const std::string& subject, std::span<const std::byte> payload);
  /// The next message, for which it waits at most so long; nullopt: none came, or the link is lost.
  std::optional<Bytes> next(std::chrono::milliseconds wait);

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
};

}  // namespace brachy::net
