#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "net/base/clock.h"
#include "net/broker/broker_options.h"
#include "net/broker/chunks.h"

namespace brachy::net {

/// Callbacks of a session feed, on its own thread.
struct FeedHandlers {
  /// The next message of the session. False: invalid; a complete publication is requested.
  std::function<bool(const ChunkAssembler::Message&)> on_message;
  /// The broker was connected or lost (`why`); once each time.
  std::function<void(bool is_connected, const std::string& why)> on_broker;
  /// A message is missing, or none has arrived: a complete publication was requested.
  std::function<void()> on_asked;
};

/// Reads a session that a Publisher publishes. Reconnects when the broker is lost, and requests a complete
/// publication once a second until it arrives. Messages wait in libnats' buffer (NatsLink::kMaxPendingBytes) while
/// on_message runs. Threads: occupies one, until `stop`, which it checks every 0.1 s, or every 1 s while connecting.
void run_session_feed(const std::stop_token& stop, const BrokerOptions& options, const FeedHandlers& handlers,
                      Clock& clock);

}  // namespace brachy::net
