#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/error.h"
#include "core/sim/mesh_state.h"
#include "core/tissue/tissue.h"
#include "net/access/gate.h"
#include "net/connection.h"
#include "net/server_options.h"
#include "net/wire/messages.h"

namespace boost::asio {
class io_context;
}

namespace brachy::net {

/// The native protocol's server (net/PROTOCOL.md): many viewers, one device a needle; snapshots and forces out, poses
/// in. It makes no thread: everything happens on the one thread that runs `io`, handlers included. Whatever a peer does ends that
/// peer's session at worst; no peer delays another.
///
/// Threads: publish() from any one thread at a time, also while the io thread runs; all else (constructor and
/// destructor too) on the io thread or while nothing runs `io`.
/// Real-time: publish() allocates and takes a lock of Asio's: call it from the snapshot thread, not from the
/// deformation thread. Snapshots wait in `io` until the io thread takes them.
class Server {
 public:
  /// Binds, listens and accepts from here on; clients are served once `io` runs. Copies what it needs of `tissue`.
  /// Throws UserError: bad address or option, address not loopback without allow_remote, port in use or forbidden.
  Server(boost::asio::io_context& io, ServerOptions options, const Tissue& tissue, ServerHandlers handlers);
  ~Server();  ///< ends every session at once; not from inside a handler
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;           ///< the port bound
  const std::string& address() const;   ///< the address bound
  std::uint64_t topology_hash() const;  ///< of all points
  const ServerOptions& options() const;

  /// Who may connect, for the other listeners too.
  Gate& gate();

  /// Starts a session on a connection that another listener made, with the place that the gate gave it; where that is none
  /// to stay in, it is told so. Any after stop() is closed at once.
  void adopt(std::shared_ptr<Connection> connection, std::shared_ptr<const Gate::Place> place);

  /// As adopt(), of a viewer in this process: it takes no place, needs no token and is not counted.
  void adopt_own(std::shared_ptr<Connection> connection);

  /// A new snapshot for everybody; `state` must not change any more. Its ticks must not go backwards, unless the
  /// simulation began anew; then, and with another model, everybody gets a full frame.
  void publish(std::shared_ptr<const MeshState> state);

  /// To every client.
  void broadcast(const EventMessage& event);

  /// To every client that gets the mesh, now or once it is there.
  void publish(const DoseMessage& dose);

  /// For every client that asks for the scene from here on.
  void show_scene(const SceneMessage& scene);

  /// A STATE to everybody, now.
  void tell_state();

  // Needles are counted from 0 and are fewer than ServerOptions::needles (asserted).

  /// Takes the needle's device lease for the daemon's own device. False where a network device holds it.
  bool hold_lease(std::uint16_t needle, const std::string& name);
  /// Gives up what hold_lease took; does nothing otherwise.
  void release_lease(std::uint16_t needle);
  std::string lease_holder(std::uint16_t needle) const;  ///< "NAME (ADDRESS)", empty = nobody

  /// A device that came in by another protocol takes the lease of device.needle on the same terms as a client of this one,
  /// or is told why not. Everybody hears of it.
  std::optional<ErrorMessage> attach(const DeviceInfo& device);
  /// Ends what attach() gave for this needle; does nothing otherwise.
  void detach(std::uint16_t needle, const std::string& reason);
  /// A pose of such a device, with the verdict it gets; counted as any other.
  PoseVerdict submit(std::uint16_t needle, const NeedlePose& pose);
  /// One that was refused before it came so far.
  void count_refusal(const PoseVerdict& verdict);

  /// To the needle's network device, if there is one. Of each kind at most one waits: a newer one replaces it and is
  /// counted, so that a slow device gets few messages but never old ones. False where the message replaced one or there
  /// is no device.
  bool send(std::uint16_t needle, const ForceMessage& message);
  bool send(std::uint16_t needle, const LocalModelMessage& message);
  std::uint64_t forces_replaced() const;  ///< of both kinds, since start

  /// From a PING to its answer, of the needle's network device: median of the last few, asked about every 100 ms.
  /// nullopt without a device and before its first answer. In it is whatever keeps the device from answering; its own
  /// stamps are not.
  std::optional<double> round_trip_s(std::uint16_t needle) const;

  std::size_t client_count() const;  ///< connected and not being closed

  /// Who is there, by role; devices also those that attach() let in.
  struct RoleCounts {
    std::size_t viewers = 0, devices = 0, operators = 0;
  };
  RoleCounts role_counts() const;
  /// What a STATE says to everybody, and what was dropped for all clients since start.
  StateMessage state() const;

  /// Stops listening, tells every client, and lets what is being sent leave for at most drain_timeout; after that
  /// `io` has nothing left to do for this server.
  void stop();

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace brachy::net
