#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/error.h"
#include "core/sim/mesh_state.h"
#include "core/tissue/tissue.h"

namespace boost::asio {
class io_context;
}

namespace brachy::net {
class Server;
}

namespace brachy::net::igtl {

/// Settings of an IgtlServer beside those it has in common with the Server: address, allow_remote, places, max_poses_per_s,
/// timeouts and send buffer.
struct IgtlOptions {
  std::uint16_t port = 0;    ///< 0 = any free one, IgtlServer::port() tells
  double surface_hz = 10;    ///< POLYDATA a second at most, > 0, ≤ 15
  double transform_hz = 30;  ///< TRANSFORMs of each name a second at most, likewise TDATA; > 0
  /// A client that says nothing for this long after it connected is one that listens.
  std::chrono::milliseconds first_message_wait{1000};
  bool without_token = false;  ///< also where the server's other clients need one
};

/// What 3D Slicer and PLUS connect to: OpenIGTLink beside the native protocol, as net/IGTL.md says. Clients that send a
/// needle's TRANSFORM take its device lease from `server` as a native device does, for as long as they keep sending. It
/// makes no thread: everything happens on the one that runs `io`. Whatever a peer does ends that peer's connection at
/// worst; no peer delays another.
///
/// Threads: publish() from any one thread at a time, also while the io thread runs; all else (constructor and
/// destructor too) on the io thread or while nothing runs `io`.
/// Real-time: publish() allocates and takes a lock of Asio's: call it from the snapshot thread.
class IgtlServer {
 public:
  using Log = std::function<void(const std::string&)>;  ///< one line, no line end

  /// Binds, listens and accepts from here on. `server` must outlive it; copies what it needs of `tissue`.
  /// The server's address where that is loopback or allow_remote is given, else 127.0.0.1: the protocol knows neither tokens
  /// nor TLS. Throws UserError: port in use or forbidden; tokens without without_token.
  IgtlServer(boost::asio::io_context& io, const IgtlOptions& options, Server& server, const Tissue& tissue,
             Log log);
  ~IgtlServer();  ///< ends every connection at once
  IgtlServer(const IgtlServer&) = delete;
  IgtlServer& operator=(const IgtlServer&) = delete;

  const std::string& address() const;  ///< the address bound
  std::uint16_t port() const;          ///< the port bound

  /// A new snapshot for everybody; `state` must not change any more.
  void publish(std::shared_ptr<const MeshState> state);

  std::size_t client_count() const;        ///< connected and not being closed
  std::uint64_t surfaces_encoded() const;  ///< since start: once a snapshot and header version at most
  std::uint64_t messages_dropped() const;  ///< of clients since start: wrong CRC, or no sense in it

  /// Stops listening, tells every client, and lets what is being sent leave for at most the server's drain_timeout.
  void stop();

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace brachy::net::igtl
