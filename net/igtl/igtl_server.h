#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/tissue/tissue.h"
#include "core/simulation/mesh_state.h"
#include "net/igtl/content/needle_name.h"
#include "net/igtl/content/tracking_feed.h"
#include "net/igtl/igtl_session.h"
#include "net/transport/tcp/tcp_link.h"

namespace boost::asio {
class io_context;
}

namespace brachy::net {
struct ImageMessage;
class Server;
}  // namespace brachy::net

namespace brachy::net::igtl {

/// Settings of an IgtlServer. It shares these with the Server: address, allow_remote, connection limits,
/// max_poses_per_s, timeouts and send buffer.
struct IgtlOptions {
  std::uint16_t port = 0;    ///< 0 = any free one, see IgtlServer::port()
  double surface_hz = 10;    ///< POLYDATA a second at most, > 0, ≤ 15
  double transform_hz = 30;  ///< TRANSFORMs of each name a second at most, likewise TDATA; > 0
  /// A client that sends nothing for this long after connecting is a listener.
  std::chrono::milliseconds first_message_wait{1000};
  bool without_token = false;  ///< accept clients although the server requires tokens elsewhere
  bool listens = true;         ///< false: connects only; `port` is not used
  /// An OpenIGTLink server to connect to, whose TRANSFORMs move needles as a client's do.
  std::optional<LinkTarget> connect = {};
  bool connect_sends = false;      ///< sends it what clients get, as to a 3D Slicer that listens
  Naming naming = {};              ///< of tools, and the frame of all coordinates
  std::vector<Vec3> targets = {};  ///< planned seeds at rest, W, mm: POINT "Targets", and ErrorToRas
  bool takes_commands = false;     ///< STRING and COMMAND go to Server::requests(); else they are skipped
};

/// OpenIGTLink for 3D Slicer and PLUS, beside the native protocol (net/IGTL.md). Clients that send a
/// needle's TRANSFORM take its device lease from `server` as a native device does, for as long as they keep sending. It
/// makes no thread: everything happens on the one that runs `io`. At worst a peer ends its own connection; no peer
/// delays another.
///
/// Threads: publish() from any one thread at a time, also while the io thread runs; all else (constructor and
/// destructor too) on the io thread or while nothing runs `io`.
/// Real-time: publish() allocates and takes a lock of Asio's: call it from the snapshot thread.
class IgtlServer {
 public:
  using Log = std::function<void(const std::string&)>;  ///< one line, no line end

  /// Binds, listens and accepts from here on. `server` must outlive it; copies what it needs of `tissue`.
  /// Connects to options.connect, again and again; it must be loopback unless allow_remote is set, or a UserError
  /// says so.
  /// Uses the server's address where that is loopback or allow_remote is set, else 127.0.0.1: the protocol has
  /// neither tokens nor TLS. Throws UserError: port in use or forbidden; tokens without without_token.
  IgtlServer(boost::asio::io_context& io, const IgtlOptions& options, Server& server, const Tissue& tissue,
             Log log);
  ~IgtlServer();  ///< ends every connection at once
  IgtlServer(const IgtlServer&) = delete;
  IgtlServer& operator=(const IgtlServer&) = delete;

  const std::string& address() const;  ///< the address bound
  std::uint16_t port() const;          ///< the port bound

  /// A new snapshot for every client; `state` must not change any more.
  void publish(std::shared_ptr<const MeshState> state);

  /// A newer ultrasound image, uncompressed, for the clients that asked for such.
  void publish_image(std::shared_ptr<const ImageMessage> image);
  bool wants_images() const;  ///< a client asked for them
  /// What is set at the scanner from now on: images of other arrays, or of before it was frozen or set free, answer no
  /// GET_IMAGE.
  void set_scanner(const ScannerMessage& scanner);
  /// How often, so far, a client asked that is to get an image, also a frozen one.
  std::uint64_t images_asked() const;
  /// Whether a client asked for TDATA more often than there are snapshots. On the io thread.
  bool wants_ticks() const;
  /// A newer tick for TDATA, and when it was, UTC. On the io thread; snapshots have their own.
  void track(TrackedTick tick, std::int64_t utc_ns);

  std::size_t client_count() const;        ///< connected and not being closed
  std::uint64_t surfaces_encoded() const;  ///< since start: once a snapshot and header version at most
  std::uint64_t messages_dropped() const;  ///< of clients since start: wrong CRC, or invalid
  std::uint64_t other_names() const;       ///< TRANSFORMs since start whose name is no needle's: skipped
  /// Of clients that have left and of those connected, since start: what was not taken or not sent, and not in the
  /// above.
  IgtlSession::Losses losses() const;
  bool is_link_up() const;  ///< connected to options.connect

  /// Stops listening, notifies every client, and sends what is pending for at most the server's drain_timeout.
  void stop(const std::string& why = kServerStops);

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace brachy::net::igtl
