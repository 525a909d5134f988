#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "net/wire/byte_io.h"

namespace brachy::net {

/// Callbacks of a connection to its owner; always from the io thread and never from inside a call of Connection.
class ConnectionListener {
 public:
  virtual ~ConnectionListener() = default;
  virtual void on_bytes(std::span<const std::byte> bytes) = 0;
  /// From a transport with message boundaries, such as WebSocket: one whole message, as sent.
  virtual void on_message(std::span<const std::byte> bytes) { on_bytes(bytes); }
  virtual void on_written() = 0;
  /// The peer or the network ended it; last call. Not after Connection::close().
  virtual void on_closed(const std::string& reason) = 0;
};

/// A byte stream to one peer: the interface between the sessions and the transports (TCP, TLS, WebSocket).
/// Threads: the io thread only.
class Connection {
 public:
  virtual ~Connection() = default;
  /// Begins to read. Keeps the listener alive until the end.
  virtual void start(std::shared_ptr<ConnectionListener> listener) = 0;
  /// Sends header and body (may be null); one write at a time, on_written() ends it.
  virtual void write(Bytes header, std::shared_ptr<const Bytes> body) = 0;
  /// No more writes: the peer reads the end of the stream. Reading goes on.
  virtual void shutdown_send() = 0;
  /// The peer may send messages of that size from now on: for a transport that knows where they end, and limits them.
  virtual void allow_messages_of(std::size_t /*bytes*/) {}
  /// Ends at once; no listener call comes after it.
  virtual void close() = 0;
  /// When the running write last sent bytes (or began).
  virtual std::int64_t last_progress_ns() const = 0;
  /// When a write last sent bytes after it had to wait for the peer, 0 = never: a peer that reads slowly, but reads.
  virtual std::int64_t last_waited_progress_ns() const = 0;
  /// Bytes written that still wait in this machine for a peer that reads too slowly; 0 where the system cannot tell.
  virtual std::size_t unsent_bytes() const = 0;
  virtual const std::string& peer() const = 0;  ///< "address:port"
};

}  // namespace brachy::net
