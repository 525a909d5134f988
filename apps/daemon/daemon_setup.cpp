#include "apps/daemon/daemon_setup.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "apps/command_line/viewer_files.h"
#include "apps/reports/tissue_box.h"
#include "core/base/error.h"
#include "core/base/rigid_transform_text.h"
#include "core/base/version.h"
#include "core/scene/load_tissue.h"
#include "haptics/trajectory/needle_trajectories.h"
#include "net/access/token_file.h"
#include "net/broker/broker_options.h"
#include "net/http/served_files.h"
#include "net/igtl/content/needle_name.h"
#include "net/igtl/igtl_server.h"
#include "net/session/server_options.h"
#include "net/transport/tcp/tcp_link.h"

namespace brachy {
namespace {

net::TokenGrants load_tokens(const Scene& scene) {
  using enum net::Role;
  net::TokenGrants tokens;
  const auto add = [&](const std::string& file, std::initializer_list<net::Role> roles) {
    if (!file.empty()) tokens.add(net::load_token(scene.resolve(file)), roles);
  };
  add(scene.server.token_file, {kViewer, kDevice, kOperator});
  add(scene.server.device_token_file, {kViewer, kDevice});
  add(scene.server.viewer_token_file, {kViewer});
  return tokens;
}

net::TlsContext load_tls(const Scene& scene) {
  const auto resolve = [&](const std::string& file) {
    return file.empty() ? std::filesystem::path() : scene.resolve(file);
  };
  const ServerSettings& s = scene.server;
  return net::make_server_context({resolve(s.tls_certificate), resolve(s.tls_key), resolve(s.tls_client_ca)},
                                  [](const std::string& line) { spdlog::warn("{}", line); });
}

/// About its surface.
TissueBall ball_about(const Tissue& tissue) {
  TissueBall ball{centre_of(tissue), 0};
  for (std::size_t v = 0; v < tissue.surface_count; ++v)
    ball.radius_mm = std::max(ball.radius_mm, (tissue.rest_vertices[v] - ball.middle).norm());
  return ball;
}

}  // namespace

Tissue load_simulated_tissue(const Scene& scene) {
  LoadedTissue loaded = load_tissue(scene);
  const SurfaceReport& report = loaded.report;
  spdlog::info("tissue: {} points, {} on the surface, {:.1f} cc", loaded.tissue.size(),
               loaded.tissue.surface_count, report.volume_cc);
  if (report.dropped_islands)
    spdlog::warn("tissue: {} islands of {:.2g} cc together were dropped", report.dropped_islands,
                 report.dropped_island_volume_cc);
  if (report.flipped_triangles)
    spdlog::info("tissue: {} triangles turned outwards", report.flipped_triangles);
  return std::move(loaded.tissue);
}

std::vector<std::unique_ptr<SwitchedDevice>> make_devices(const Scene& scene, const Tissue& tissue,
                                                          std::size_t count) {
  std::vector<std::optional<ScriptedDevice>> scripts(count);
  if (!scene.device.trajectory.empty()) {
    NeedleTrajectories all =
        load_trajectories(scene.resolve(scene.device.trajectory), static_cast<int>(count));
    for (const std::string& doubt : doubts_about(all)) spdlog::warn("{}: {}", scene.device.trajectory, doubt);
    if (scene.device.centre_on_tissue) all = all.centred_on(centre_of(tissue));
    for (const auto& needle : all.needles())
      scripts[needle.id].emplace(needle.motion, scene.device.loop, all.start_s(), all.end_s());
  }
  PoseGuardSettings guard;
  guard.stale_ns = static_cast<std::int64_t>(scene.device.stale_pose_ms * 1e6);
  guard.tissue = ball_about(tissue);
  std::vector<std::unique_ptr<SwitchedDevice>> devices;
  devices.reserve(count);
  for (auto& script : scripts) devices.push_back(std::make_unique<SwitchedDevice>(guard, std::move(script)));
  return devices;
}

net::ServerOptions server_options(const Scene& scene, const DaemonOptions& options, std::size_t needles) {
  net::ServerOptions s;
  s.needles = static_cast<std::uint16_t>(needles);
  s.address = scene.server.address;
  s.port = static_cast<std::uint16_t>(options.port.value_or(scene.server.port));
  s.allow_remote = options.insecure_allow_remote;
  s.tokens = load_tokens(scene);
  if (scene.server.has_tls()) s.tls = load_tls(scene);
  s.max_clients = static_cast<std::uint32_t>(scene.server.max_clients);
  s.max_clients_per_address = static_cast<std::uint32_t>(scene.server.max_clients_per_address);
  s.max_message_bytes = static_cast<std::uint32_t>(scene.server.max_message_bytes);
  s.max_poses_per_s = static_cast<std::uint32_t>(scene.server.max_poses_per_s);
  s.hello_timeout = std::chrono::milliseconds(scene.server.hello_timeout_ms);
  s.silence_timeout = std::chrono::milliseconds(scene.server.silence_timeout_ms);
  s.stall_timeout = std::chrono::milliseconds(scene.server.stall_timeout_ms);
  s.server_name = "brachyd " + version();
  s.topology_name = scene.name;
  s.deformation_hz = scene.rates.deformation_hz;
  s.snapshot_hz = scene.rates.snapshot_hz;
  s.has_ultrasound = scene.ultrasound.on;
  if (scene.probe.on) s.probe_needle = static_cast<std::uint16_t>(scene.needle.count);
  return s;
}

std::optional<net::BrokerOptions> broker_options(const Scene& scene, const DaemonOptions& options) {
  const BrokerSettings& s = scene.broker;
  net::BrokerOptions o;
  o.url = options.broker.value_or(s.url);
  if (o.url.empty()) return std::nullopt;
  const auto resolve = [&](const std::string& file, const char* key) {
    if (file.empty()) return std::string();
    const std::filesystem::path path = scene.resolve(file);
    if (!std::filesystem::is_regular_file(path))
      throw UserError("broker." + std::string(key) + ": there is no file " + path.string());
    return path.string();
  };
  o.session = s.session;
  o.tls_ca = resolve(s.tls_ca, "tls_ca");
  o.tls_certificate = resolve(s.tls_certificate, "tls_certificate");
  o.tls_key = resolve(s.tls_key, "tls_key");
  o.client_name = "brachyd " + s.session;
  net::check_broker_options(o, options.broker ? "--nats" : "broker.url");
  return o;
}

net::ServedFiles served_viewer() {
  net::ServedFiles files = viewer_files();
  if (!files.has_viewer()) spdlog::warn("the viewer is not built: browsers get a page that says how");
  return files;
}

std::optional<net::igtl::IgtlOptions> igtl_options(const Scene& scene, const DaemonOptions& options) {
  const ServerSettings& s = scene.server;
  const int port = options.igtl_port.value_or(s.igtl_port);
  if (port < 0 && s.igtl_connect.empty()) return std::nullopt;
  net::igtl::IgtlOptions o;
  o.listens = port >= 0;
  o.port = static_cast<std::uint16_t>(std::max(port, 0));
  o.without_token = s.igtl_without_token;
  o.takes_commands = s.igtl_commands;
  if (!s.igtl_connect.empty()) o.connect = net::link_target(s.igtl_connect, "server.igtl_connect");
  o.connect_sends = s.igtl_connect_sends;
  o.naming.frame = s.igtl_frame;
  o.naming.X_WF = rigid_transform_from(s.igtl_frame_pose).value_or(RigidTransform());
  if (scene.probe.on) o.naming.probe = static_cast<std::uint16_t>(scene.needle.count);
  o.naming.needle_names = net::igtl::names_in(s.igtl_needle_names);
  if (o.naming.needle_names.size() > scene.instrument_count())
    throw UserError("server.igtl_needle_names has more names than the scene has needles; set needle.count");
  return o;
}

}  // namespace brachy
