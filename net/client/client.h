#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "net/base/clock.h"
#include "net/base/clock_offset.h"
#include "net/client/server_messages.h"
#include "net/transport/tls/tls_context.h"

namespace boost::asio {
class io_context;
}

namespace brachy::net {

struct ClientOptions {
  Role role = Role::kViewer;
  std::uint32_t subscription = 0;  ///< Subscription bits
  std::uint16_t image_flags = 0;   ///< ImageRequestFlag bits (net/wire/image_pixels.h)
  DeviceLimits limits;
  std::uint16_t needle = kAnyNeedle;   ///< of a device: the one it asks for
  bool evaluates_local_model = false;  ///< a device that computes its force itself
  std::string name = "client";
  std::optional<Token> token;  ///< for a server that requires one
  TlsContext tls;              ///< none: no encryption
  std::chrono::milliseconds connect_timeout{3000};
  std::chrono::milliseconds silence_timeout{
      5000};  ///< disconnect from a server that sends nothing for this long
  std::chrono::milliseconds ping_interval{
      1000};  ///< for the clock offset, and to avoid the server's silence timeout
  std::uint32_t max_message_bytes = 256u << 20;  ///< body from the server
  std::size_t max_queued_poses = 64;             ///< the oldest waiting pose is dropped beyond this
  TimerClock* clock = &real_clock();             ///< of stamps and timeouts
};

/// Called on the io thread, in the order of the messages. Empty ones are skipped. A handler may close() the client,
/// but not destroy it.
struct ClientHandlers : MessageHandlers {
  std::function<void(const std::string& reason)> on_closed;  ///< once, last; not after close()
};

/// A viewer's, device's or operator's end of the native protocol. Any message that violates the protocol ends the
/// connection, reported by on_closed. Threads: all on the thread that runs `io`.
class Client {
 public:
  Client(boost::asio::io_context& io, ClientOptions options, ClientHandlers handlers);
  ~Client();  ///< closes
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Connects and sends HELLO; blocks until connected, at most about connect_timeout and the name's look-up. Once only.
  /// Throws UserError ("nothing listens on …"). The WELCOME arrives by on_welcome when `io` runs; a refused
  /// certificate is reported by on_closed.
  void connect(const std::string& host, std::uint16_t port);

  /// Queues a POSE of our needle, taken at `stamp_ns` of our monotonic clock. Frames echo the stamp as input_stamp_ns.
  void send_pose(const RigidTransform& X_WN, std::int64_t stamp_ns);
  /// Ends a latched fault of our needle, or as operator of `needle`: its force returns by a ramp.
  void arm() { arm(needle()); }
  void arm(std::uint16_t needle);
  /// As operator: controls the running simulation. A refusal is reported by on_error.
  void control(const ControlMessage& message);
  /// As operator: the button of a needle that the daemon's own device moves.
  void press(std::uint16_t needle, bool pressed);
  /// Reports that our needle's button went down or up; in order with the poses, and never dropped.
  void press(bool pressed);
  void request_state();
  /// Sends any other message of a client, in order with arm() and control().
  template <WireMessage Message>
  void send(const Message& message) {
    Bytes body;
    encode_body(message, body);
    send_body(Message::kType, std::move(body));
  }
  void close();

  bool is_open() const;
  const FrameAssembler& mesh() const;
  /// Of a device: granted by WELCOME; before it the one asked for, or 0.
  std::uint16_t needle() const;
  std::uint64_t poses_sent() const;
  std::uint64_t poses_dropped() const;  ///< not sent because too many waited
  std::uint64_t frames() const;
  std::uint64_t snapshots_missed() const;  ///< gaps in the snapshot sequence since the first frame
  std::uint64_t bytes_received() const;
  /// Server's clock − ours, from PING; nullopt before the first answer.
  std::optional<ClockOffset::Sample> clock_offset() const;

 private:
  class Impl;
  void send_body(MessageType type, Bytes body);

  std::shared_ptr<Impl> impl_;
};

}  // namespace brachy::net
