#include <algorithm>
#include <cctype>

#include "core/base/rigid_transform_text.h"
#include "core/scene/file/scene_keys.h"

namespace brachy {
namespace {

using enum Reload;

std::vector<Key<RateSettings>> rates_keys() {
  using S = RateSettings;
  return {
      number("deformation_hz", &S::deformation_hz, {1, 1000}, kRestart, "ticks of the simulation"),
      number("snapshot_hz", &S::snapshot_hz, {1, 120}, kRestart, "meshes sent to viewers"),
  };
}

std::vector<Key<EngineSettings>> engine_keys() {
  using S = EngineSettings;
  return {
      text("simd", &S::simd, {"auto", "generic", "sse4", "avx2", "avx512"}, kLive,
           "instruction set; name one where the results must be the same bits on other machines"),
      integer("threads", &S::threads, {1, 64}, kLive,
              "OpenMP threads; more than one pays above about 100,000 points, on idle cores"),
  };
}

std::vector<Key<WorkCosts>> work_cost_keys() {
  using S = WorkCosts;
  constexpr Range kSeconds = {1e-9, 1};
  return {
      number("system_s", &S::system_s, kSeconds, kLive, "a tick before any landmark, with its determinants"),
      number("landmark_s", &S::landmark_s, kSeconds, kLive, "and for each landmark"),
      number("landmark_pair_s", &S::landmark_pair_s, kSeconds, kLive, "and for each pair of landmarks"),
      number("step_s", &S::step_s, kSeconds, kLive, "a sub-step, but for blocks and certificate"),
      number("certificate_pair_s", &S::certificate_pair_s, kSeconds, kLive,
             "a pair of a lattice and a source in the search for folds"),
      number("block_ring_steps_per_s", &S::block_ring_steps_per_s, {1e5, 1e10}, kLive,
             "the field of one ring in one sub-step at the points of a block, how many in a second"),
  };
}

std::vector<Key<RealtimeSettings>> realtime_keys() {
  using S = RealtimeSettings;
  return {
      integer("fifo_priority", &S::fifo_priority, {0, 99}, kRestart,
              "SCHED_FIFO of the deformation thread; 0: ordinary scheduling"),
      flag("lock_memory", &S::lock_memory, kRestart, "mlockall"),
      flag("control_thread", &S::control_thread, kRestart,
           "an idle thread with the same deadlines, which counts what the machine itself misses"),
  };
}

std::vector<Key<DeviceSettings>> device_keys() {
  using S = DeviceSettings;
  return {
      text("kind", &S::kind, {"network", "scripted"}, kRestart,
           "a client with the role device; or `trajectory`, played by the daemon"),
      text("trajectory", &S::trajectory, {}, kRestart, "CSV: t_s,m00,…,m23; relative to this file"),
      flag("loop", &S::loop, kRestart, "repeat the trajectory"),
      flag("centre_on_tissue", &S::centre_on_tissue, kRestart,
           "move the trajectory so that its tip rests at the tissue's centre"),
      number("stale_pose_ms", &S::stale_pose_ms, {1, 60000}, kRestart, "poses older than this are rejected"),
  };
}

void check_device(const TomlTable& t, Scene& scene) {
  if (scene.device.kind == "scripted" && scene.device.trajectory.empty())
    t.contradiction("kind", "is \"scripted\" and needs device.trajectory = \"FILE.csv\"");
}

std::vector<Key<ServerSettings>> server_keys() {
  using S = ServerSettings;
  return {
      text("address", &S::address, {}, kRestart, "the address to bind to"),
      integer("port", &S::port, {0, 65535}, kRestart, "0: a free one"),
      integer("http_port", &S::http_port, {-1, 65535}, kRestart,
              "of the viewer in a browser and its WebSocket; 0: a free one, -1: off"),
      integer("igtl_port", &S::igtl_port, {-1, 65535}, kRestart,
              "of OpenIGTLink for 3D Slicer and PLUS (net/IGTL.md), usually 18944; 0: a free one, -1: off"),
      text("igtl_connect", &S::igtl_connect, {}, kRestart,
           "HOST:PORT of an OpenIGTLink server, such as PLUS's, whose TRANSFORMs move the needles; empty: "
           "none"),
      flag("igtl_connect_sends", &S::igtl_connect_sends, kRestart,
           "sends that server what clients get, as a 3D Slicer that listens takes it"),
      text("igtl_needle_names", &S::igtl_needle_names, {}, kRestart,
           "names of TRANSFORMs that move needle 0, 1, …: \"StylusTipToReference, ProbeToReference\"; beside "
           "NeedleToRas, Needle1ToRas, …"),
      text("igtl_frame", &S::igtl_frame, {}, kRestart,
           "the frame of OpenIGTLink's coordinates, in and out: names end in To…; letters and digits, at "
           "most 10"),
      text("igtl_frame_pose", &S::igtl_frame_pose, {}, kRestart,
           "that frame in RAS: 12 or 16 numbers, row by row, mm; LPS is \"-1 0 0 0  0 -1 0 0  0 0 1 0\"; "
           "empty: "
           "it is RAS"),
      flag("igtl_commands", &S::igtl_commands, kRestart,
           "OpenIGTLink's STRING and COMMAND control the simulation (net/IGTL.md); it has no tokens"),
      text("token_file", &S::token_file, {}, kRestart,
           "written by `brachy token FILE`, relative to this file; its holder may have any role. With one "
           "of these three every client needs a token"),
      text("device_token_file", &S::device_token_file, {}, kRestart, "its holder may be device or viewer"),
      text("viewer_token_file", &S::viewer_token_file, {}, kRestart, "its holder may be viewer"),
      flag("igtl_without_token", &S::igtl_without_token, kRestart,
           "OpenIGTLink has no tokens: with one of the above it is refused unless this is true"),
      text("tls_certificate", &S::tls_certificate, {}, kRestart,
           "PEM, relative to this file; with tls_key: TLS on port and http_port"),
      text("tls_key", &S::tls_key, {}, kRestart, "PEM, of tls_certificate"),
      text("tls_client_ca", &S::tls_client_ca, {}, kRestart,
           "PEM: clients must present a certificate signed by it; empty: none"),
      integer("max_clients", &S::max_clients, {1, 1024}, kRestart, "on all ports together"),
      integer("max_clients_per_address", &S::max_clients_per_address, {1, 1024}, kRestart, "of max_clients"),
      integer("max_message_bytes", &S::max_message_bytes, {256, 16 << 20}, kRestart, "from a client"),
      number("max_poses_per_s", &S::max_poses_per_s, {1, 100000}, kRestart, "from a client"),
      integer("hello_timeout_ms", &S::hello_timeout_ms, {100, 60'000}, kRestart,
              "from the connection to a complete HELLO"),
      // The server pings each client every second.
      integer("silence_timeout_ms", &S::silence_timeout_ms, {1500, 600'000}, kRestart,
              "a client that sends no message for this long is closed; it is pinged every second"),
      integer("stall_timeout_ms", &S::stall_timeout_ms, {100, 600'000}, kRestart,
              "a stalled client, which reads nothing for this long, is closed"),
  };
}

void check_server(const TomlTable& t, Scene& scene) {
  const ServerSettings& s = scene.server;
  if (s.tls_certificate.empty() != s.tls_key.empty())
    t.contradiction(s.tls_key.empty() ? "tls_certificate" : "tls_key",
                    std::string("needs server.") + (s.tls_key.empty() ? "tls_key" : "tls_certificate") +
                        " = \"FILE.pem\" beside it");
  const auto is_name = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
  if (s.igtl_frame.empty() || s.igtl_frame.size() > 10 || !std::ranges::all_of(s.igtl_frame, is_name))
    t.contradiction("igtl_frame", "is of letters and digits, 1 to 10 of them");
  if (!s.igtl_frame_pose.empty() && !rigid_transform_from(s.igtl_frame_pose))
    t.contradiction("igtl_frame_pose",
                    "is no rigid transform: 12 or 16 numbers, row by row, mm, \"1 0 0 0  0 1 0 0  "
                    "0 0 1 0\" for RAS itself");
  if (!s.tls_client_ca.empty() && s.tls_certificate.empty())
    t.contradiction("tls_client_ca", "needs TLS: give server.tls_certificate and server.tls_key");
}

std::vector<Key<DisplaySettings>> display_keys() {
  return {text("volume", &DisplaySettings::volume, {}, kRestart,
               "NRRD at rest that viewers show in slices, such as the image that the structures were drawn "
               "on, relative to this file; empty: none")};
}

std::vector<Key<BrokerSettings>> broker_keys() {
  using S = BrokerSettings;
  return {
      text("url", &S::url, {}, kRestart,
           "nats://HOST:4222, with TLS tls://…, with a login nats://USER:PASSWORD@… or nats://TOKEN@…; "
           "empty: off"),
      text("session", &S::session, {}, kRestart, "which a relay subscribes to: letters, digits, _ and -"),
      text("tls_ca", &S::tls_ca, {}, kRestart,
           "PEM, relative to this file: it signed the broker's certificate; empty: the system's authorities"),
      text("tls_certificate", &S::tls_certificate, {}, kRestart,
           "PEM, presented to a broker that requires one; needs tls_key"),
      text("tls_key", &S::tls_key, {}, kRestart, "PEM, of tls_certificate"),
  };
}

}  // namespace

std::vector<SceneSection> service_sections() {
  return {
      {"rates", "The rates of the two loops.",
       within<Scene>(
           rates_keys(), [](auto& s) -> auto& { return s.rates; })},
      {"engine", "How the field is evaluated.",
       within<Scene>(
           engine_keys(), [](auto& s) -> auto& { return s.engine; })},
      {"work_costs",
       "What a tick's work costs on this machine, as `brachyd doctor` prints it: what a tick may do is "
       "counted "
       "by these figures, never timed, so the same figures give the same bits on any machine.",
       within<Scene>(
           work_cost_keys(), [](auto& s) -> auto& { return s.work_costs; })},
      {"realtime", "The deformation thread.",
       within<Scene>(
           realtime_keys(), [](auto& s) -> auto& { return s.realtime; })},
      {"device", "Where the needle's pose comes from.",
       within<Scene>(
           device_keys(), [](auto& s) -> auto& { return s.device; }),
       check_device},
      {"server", "Ports, access and limits of the server.",
       within<Scene>(
           server_keys(), [](auto& s) -> auto& { return s.server; }),
       check_server},
      {"display", "What viewers show beside the simulation.",
       within<Scene>(
           display_keys(), [](auto& s) -> auto& { return s.display; })},
      {"broker", "Relaying to many viewers: a NATS server, and `brachy relay` on the viewers' machines.",
       within<Scene>(
           broker_keys(), [](auto& s) -> auto& { return s.broker; })},
  };
}

}  // namespace brachy
