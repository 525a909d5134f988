#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "core/geometry/tissue/tissue.h"
#include "core/simulation/mesh_state.h"
#include "net/access/gate.h"
#include "net/session/server_options.h"
#include "net/transport/connection.h"
#include "net/wire/codec.h"

namespace boost::asio {
class io_context;
}

namespace brachy::net {

class HandshakeTurns;

/// The native protocol's server (net/PROTOCOL.md): many viewers, one device a needle; snapshots and forces out, poses
/// in. It makes no thread: everything runs on the one thread that runs `io`, handlers included, but for the steps
/// of TLS handshakes where ServerOptions gives them a thread. At worst a peer ends
/// its own session; no peer delays another.
///
/// Threads: publish() from any one thread at a time, also while the io thread runs; all else (constructor and
/// destructor too) on the io thread or while nothing runs `io`.
/// Real-time: publish() allocates and takes a lock of Asio's: call it from the snapshot thread, not from the
/// deformation thread. Snapshots wait in `io` until the io thread takes them.
class Server {
 public:
  /// Binds, listens and accepts from here on; clients are served once `io` runs. Copies the parts of `tissue` it needs.
  /// Throws UserError: bad address or option, address not loopback without allow_remote, port in use or forbidden.
  Server(boost::asio::io_context& io, ServerOptions options, const Tissue& tissue, ServerHandlers handlers);
  ~Server();  ///< ends every session at once; not from inside a handler
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;           ///< the port bound
  const std::string& address() const;   ///< the address bound
  std::uint64_t topology_hash() const;  ///< of all points
  const ServerOptions& options() const;

  /// Whoever carries out a request of clients sets its handler here. The server calls none once it is being destroyed.
  RequestHandlers& requests();
  /// What requests are judged by, for the other listeners too.
  const RequestServer& request_server() const;

  /// Access control and connection limits, for the other listeners too.
  Gate& gate();
  /// Of the TLS handshakes on all ports.
  const std::shared_ptr<HandshakeTurns>& handshakes() const;

  /// Starts a session on a connection of another listener, with the slot that the gate gave it; where the slot holds a
  /// refusal, sends it and closes. Closes at once after stop().
  void adopt(std::shared_ptr<Connection> connection, std::shared_ptr<ConnectionSlot> slot);

  /// As adopt(), of a viewer in this process: it takes no slot, needs no token and is not counted.
  void adopt_own(std::shared_ptr<Connection> connection);

  /// A new snapshot for every client; `state` must not change any more. Its ticks must not go backwards, unless the
  /// simulation was reset; then, and with another model, every client gets a full frame.
  void publish(std::shared_ptr<const MeshState> state);

  /// Sends a message to every client that is connected. A client that is behind gets the newest of each type, and of
  /// EVENTs the last ones; it is not closed for what others caused.
  template <WireMessage Message>
  void broadcast(const Message& message) {
    broadcast(Message::kType, encoded_body(message));
  }
  void broadcast(const EventMessage& event);

  /// A newer DOSE, PLAN or SCANNER, to every client subscribed to it (DOSE: to the mesh), now or when it connects.
  template <WireMessage Message>
  void publish(const Message& message) {
    publish(Message::kType, encoded_body(message));
  }

  /// Sent to every client that subscribes to the scene from now on.
  void set_scene(const SceneMessage& scene);

  /// What the clients subscribed to ultrasound are to get.
  ImageDemand image_demand() const;
  /// A newer image of its array, to every client that is subscribed to ultrasound: it is not kept, since who connects
  /// later would get one of long ago, or of an array that is no longer in use. `packed`: the same with compressed
  /// pixels, for those that take them. Either may be null where image_demand() says that nobody wants it.
  void publish_image(ScannerArray array, const std::shared_ptr<const Bytes>& plain,
                     const std::shared_ptr<const Bytes>& packed);
  std::uint64_t images_dropped() const;  ///< replaced by newer ones, over all clients since start

  /// Sends a STATE to every client, now.
  void broadcast_state();

  // Needles are counted from 0 and are fewer than ServerOptions::needles (asserted).

  /// Takes the needle's device lease for the daemon's own device. False where a network device holds it.
  bool hold_lease(std::uint16_t needle, const std::string& name);
  /// Gives up what hold_lease took; does nothing otherwise.
  void release_lease(std::uint16_t needle);
  std::string lease_holder(std::uint16_t needle) const;  ///< "NAME (ADDRESS)"; empty: not held

  /// A device of another protocol takes the lease of device.needle on the same terms as a client of this one, or gets
  /// the reason why not. Clients are notified by an EVENT.
  std::optional<ErrorMessage> attach(const DeviceInfo& device);
  /// Ends the lease that attach() granted for this needle; does nothing otherwise.
  void detach(std::uint16_t needle, const std::string& reason);
  /// Submits a pose of such a device and returns the verdict; counted as any other pose.
  PoseVerdict submit(std::uint16_t needle, const NeedlePose& pose);
  /// Counts a pose that was refused before it was submitted, and tells the owner. `device`: its sender's name and
  /// address.
  void refuse_pose(const PoseVerdict& verdict, std::uint16_t needle, const std::string& device);
  /// Tells the owner of a pose that is skipped and answered by nothing.
  void note_stray_pose(std::uint16_t needle, const std::string& device, StrayPose why);

  /// To the needle's network device, if there is one. Of each kind at most one waits: a newer one replaces it and is
  /// counted, so that a slow device gets fewer messages but no old ones. False where the message replaced one or there
  /// is no device.
  bool send(std::uint16_t needle, const ForceMessage& message);
  bool send(std::uint16_t needle, const LocalModelMessage& message);
  std::uint64_t forces_replaced() const;  ///< of both kinds, since start

  /// From a PING to its answer, of the needle's network device: median of the last few, measured about every
  /// 100 ms. nullopt without a device and before its first answer. It includes any delay in the device, whose own
  /// stamps are not used.
  std::optional<double> round_trip_s(std::uint16_t needle) const;

  std::size_t client_count() const;  ///< connected and not being closed

  /// Connected clients by role; devices include those of attach().
  struct RoleCounts {
    std::size_t viewers = 0, devices = 0, operators = 0;
  };
  RoleCounts role_counts() const;
  /// The part of STATE that is common to all clients, with what was dropped for all clients since start.
  StateMessage state() const;

  /// Stops listening, notifies every client, and sends what is pending for at most drain_timeout; after that `io` has
  /// nothing left to do for this server. `why`: the text of the clients' SHUTDOWN.
  void stop(const std::string& why = kServerStops);

 private:
  class Impl;
  void broadcast(MessageType type, const std::shared_ptr<const Bytes>& body);
  void publish(MessageType type, const std::shared_ptr<const Bytes>& body);

  std::shared_ptr<Impl> impl_;
};

}  // namespace brachy::net
