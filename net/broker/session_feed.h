#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "net/broker/broker_options.h"
#include "net/broker/chunks.h"

namespace brachy::net {

/// What a session feed is told to do, on its own thread.
struct FeedHandlers {
  /// The next message of the session. False: it makes no sense, everything is asked for anew.
  std::function<bool(const ChunkAssembler::Message&)> on_message;
  /// The broker came, or went (`why`: since when nothing comes). Once each time.
  std::function<void(bool is_connected, const std::string& why)> on_broker;
  /// A message is missing, or none has come: everything was asked for.
  std::function<void()> on_asked;
};

/// Reads a session that a Publisher publishes, whatever becomes of the broker: connects again, and asks for everything anew, once a
/// second, until it comes. Messages wait in libnats' buffer (NatsLink::kMaxPendingBytes) while on_message takes one.
/// Threads: a thread's whole life, until `stop`, which it sees within 0.1 s, or 1 s while it connects.
void run_session_feed(const std::stop_token& stop, const BrokerOptions& options,
                      const FeedHandlers& handlers);

}  // namespace brachy::net
