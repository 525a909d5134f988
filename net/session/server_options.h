#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/needle/needle_pose.h"
#include "net/access/token_grants.h"
#include "net/base/clock.h"
#include "net/requests/request.h"
#include "net/transport/tls/tls_context.h"
#include "net/wire/messages.h"

namespace brachy::net {

/// Settings of a Server; all checked by its constructor.
struct ServerOptions {
  std::string address = "127.0.0.1";  ///< to bind; an IP address
  std::uint16_t port = 0;             ///< 0 = any free one, see Server::port()
  bool allow_remote = false;          ///< bind an address that is not loopback without access control
  TokenGrants tokens;                 ///< empty: none required
  TlsContext tls;                     ///< none: no encryption; with it and tokens, any address may be bound
  /// Runs the steps of TLS handshakes on a thread of its own, in order, each once or, when the program ends, never; no
  /// thread: they run on the io thread, and far fewer begin.
  std::function<void(std::function<void()>)> handshake_thread;
  std::uint16_t needles = 1;                      ///< 1 to 1024: one device lease each
  std::uint32_t max_clients = 64;                 ///< ≥ 1; connections of all listeners
  std::uint32_t max_clients_per_address = 48;     ///< ≥ 1; of them
  std::uint32_t max_message_bytes = 64 * 1024;    ///< body from a client, 256 to 64 MiB
  std::uint32_t max_poses_per_s = 2000;           ///< ≥ 1; bursts of a tenth of it pass
  std::chrono::milliseconds hello_timeout{2000};  ///< from connection to a complete HELLO
  std::chrono::milliseconds ping_interval{1000};  ///< PING a client that sent nothing for this long
  std::chrono::milliseconds silence_timeout{
      5000};  ///< close a client that completed no message for this long
  std::chrono::milliseconds stall_timeout{
      5000};  ///< close a client that read no byte of a write for this long
  std::chrono::milliseconds drain_timeout{500};   ///< for the last ERROR to leave
  std::chrono::milliseconds state_interval{500};  ///< between STATE messages
  int send_buffer_bytes = 256 * 1024;             ///< SO_SNDBUF
  std::size_t max_queued_messages = 64;           ///< control messages waiting for one client
  std::string
      devices_at;  ///< where devices and operators connect, as text; not empty: this server is view-only
  std::string server_name = "brachyd 0.1.0";  ///< sent in WELCOME
  std::string topology_name = "tissue";
  bool has_ultrasound = false;              ///< grants kSubscribeUltrasound
  std::uint16_t probe_needle = kAnyNeedle;  ///< whose device may send SCANNER; none: operators alone
  double deformation_hz = 200;
  double snapshot_hz = 30;
  TimerClock* clock = &real_clock();  ///< of stamps, rates and timeouts, of all listeners
};

/// What a client is told where the server simply ends.
inline constexpr const char* kServerStops = "the server stops";
/// A client whose answers fill its queue.
inline constexpr const char* kUnread = "too many messages wait to be read";

/// What subscribed clients are to get, at present.
struct ImageDemand {
  bool any = false;     ///< somebody subscribed
  bool packed = false;  ///< somebody of them takes compressed pixels
  bool plain = false;   ///< somebody does not
  std::uint64_t joined =
      0;  ///< so many have subscribed so far: who is new is to get an image, also a frozen one

  bool operator==(const ImageDemand&) const = default;
};

/// The device that holds, or held, the lease of a needle.
struct DeviceInfo {
  std::string name;
  std::string address;
  DeviceLimits limits;  ///< as stated, not checked
  std::uint16_t needle = 0;
  bool evaluates_local_model = false;
  bool takes_force = true;  ///< false: it renders no force, no FORCE is sent to it
  std::string reason;       ///< why it left; empty while it is connected
};

/// Called on the io thread; must be quick and must not throw. Empty ones are skipped. Of clients' requests:
/// Server::requests().
struct ServerHandlers {
  std::function<PoseVerdict(std::uint16_t needle, const NeedlePose&)>
      on_pose;                                                      ///< none: every pose is accepted
  std::function<void(bool attached, const DeviceInfo&)> on_device;  ///< a network device took or left a lease
  /// What was negotiated with the needle's device, which has just been attached; none: nothing.
  std::function<std::optional<NegotiatedLimits>(std::uint16_t needle)> negotiated;
  /// Poses came from `device`, a connection's name and address, that reach no handler of poses: why not. `needle`:
  /// whose they were to be, or 0.
  std::function<void(std::uint16_t needle, const std::string& device, StrayPose)> on_stray_pose;
  std::function<StateMessage()> state;  ///< the simulation's part of STATE; the server adds its own counts
  std::function<void(const std::string&)> log;  ///< one line, no line end
};

}  // namespace brachy::net
