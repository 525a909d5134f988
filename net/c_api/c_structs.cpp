#include "net/c_api/c_structs.h"

#include <chrono>
#include <cmath>
#include <cstdint>

namespace brachy::net::c_api {
namespace {

constexpr double kLongestWaitS = 3600;

}  // namespace

BrachydNeedle needle_of(const NeedleRecord& record) {
  const NeedleState& state = record.state;
  BrachydNeedle needle{};
  needle.id = record.id;
  needle.present = state.present;
  needle.contact = static_cast<std::int32_t>(state.contact);
  needle.puncture_count = state.puncture_count;
  needle.insertion_depth_mm = state.insertion_depth_mm;
  copy(state.X_WN, needle.X_WN);
  needle.has_force = record.has_forces;
  copy(state.forces.force_n, needle.force_n);
  needle.axial_n = state.forces.axial_n;
  return needle;
}

BrachydFrame frame_of(const FrameMessage& message) {
  BrachydFrame frame{};
  frame.tick = message.tick;
  frame.snapshot_sequence = message.snapshot_sequence;
  frame.sim_time_s = message.sim_time_s;
  frame.input_sequence = message.input_sequence;
  frame.input_stamp_ns = message.input_stamp_ns;
  frame.max_displacement_mm = message.max_displacement_mm;
  frame.step_flags = message.step_flags;
  frame.moved_vertices = message.moved_vertices;
  frame.point_count = message.point_count;
  frame.needle_count = static_cast<std::uint32_t>(message.needles.size());
  frame.verdict = message.certificate ? static_cast<std::int32_t>(message.certificate->verdict) : 0;
  frame.lag_mm = message.lag_mm;
  return frame;
}

BrachydForce force_of(const ForceMessage& message, std::int64_t received_ns) {
  constexpr std::uint32_t kDefaultValidMs = 50;
  BrachydForce force{};
  force.tick = message.tick;
  force.input_sequence = message.input_sequence;
  force.input_stamp_ns = message.input_stamp_ns;
  force.received_ns = received_ns;
  copy(message.forces.force_n, force.force_n);
  copy(message.forces.tip_torque_nmm, force.tip_torque_nmm);
  copy(message.forces.hub_torque_nmm, force.hub_torque_nmm);
  force.axial_n = message.forces.axial_n;
  force.lateral_n = message.forces.lateral_n;
  force.cutting_n = message.forces.cutting_n;
  force.friction_n = message.forces.friction_n;
  force.needle = message.needle;
  force.flags = message.flags;
  force.valid_ms = message.valid_ms == 0 ? kDefaultValidMs : message.valid_ms;
  return force;
}

BrachydState state_of(const StateMessage& message) {
  BrachydState state{};
  state.ticks = message.ticks;
  state.overruns = message.overruns;
  state.tick_p50_ms = message.tick_ms.p50;
  state.tick_p99_ms = message.tick_ms.p99;
  state.tick_max_ms = message.tick_ms.max;
  state.latency_p50_ms = message.latency_ms.p50;
  state.latency_p99_ms = message.latency_ms.p99;
  state.latency_max_ms = message.latency_ms.max;
  state.poses_accepted = message.poses_accepted;
  for (const PoseRefusals& refusals : message.refusals) state.poses_refused += refusals.count;
  state.snapshots = message.snapshots;
  state.snapshots_sent = message.snapshots_sent;
  state.snapshots_dropped = message.snapshots_dropped;
  state.events_dropped = message.events_dropped;
  state.clients = message.clients;
  state.viewers = message.viewers;
  state.support_radius_mm = message.controls.support_radius_mm;
  state.controls = message.controls.flags;
  copy_text(message.controls.kernel, state.kernel);
  copy_text(message.device_holder, state.device_holder);
  return state;
}

BrachydWelcome welcome_of(const WelcomeMessage& message) {
  BrachydWelcome welcome{};
  welcome.session = message.session;
  welcome.role = static_cast<std::int32_t>(message.role);
  welcome.subscription = message.subscription;
  welcome.needle = message.needle;
  welcome.needle_count = message.needle_count;
  welcome.deformation_hz = message.deformation_hz;
  welcome.snapshot_hz = message.snapshot_hz;
  welcome.max_poses_per_s = message.max_poses_per_s;
  copy_text(message.server, welcome.server);
  return welcome;
}

BrachydSeed seed_of(const Seed& got) {
  BrachydSeed seed{};
  seed.id = got.id;
  seed.planned = got.planned;
  seed.needle = got.needle;
  seed.fixed = got.is_fixed;
  seed.air_kerma_strength_u = got.air_kerma_strength_u;
  copy(got.position, seed.position);
  copy(got.axis, seed.axis);
  copy(got.rest, seed.rest);
  return seed;
}

BrachydEvent event_of(const EventMessage& message) {
  BrachydEvent event{};
  event.tick = message.tick;
  event.kind = static_cast<std::uint32_t>(message.kind);
  event.needle = message.needle;
  copy_text(message.text, event.text);
  return event;
}

BrachydError error_of(const ErrorMessage& message) {
  BrachydError error{};
  error.about_sequence = message.about_sequence;
  error.code = static_cast<std::uint32_t>(message.code);
  error.reason = message.reason;
  error.fatal = message.fatal;
  copy_text(message.text, error.text);
  return error;
}

BrachydScanner scanner_of(const ScannerMessage& message) {
  return {static_cast<std::int32_t>(message.array),
          static_cast<std::int32_t>(message.freeze),
          message.depth_mm,
          message.gain_db,
          message.dynamic_range_db,
          message.tgc_extra_db_per_cm,
          message.focus_mm,
          message.probe_depth_mm,
          message.probe_rotation_deg};
}

ScannerMessage scanner_message(const BrachydScanner& scanner) {
  ScannerMessage message;
  message.array = static_cast<ScannerArray>(scanner.array);
  message.freeze = static_cast<ScannerFreeze>(scanner.freeze);
  message.depth_mm = scanner.depth_mm;
  message.gain_db = scanner.gain_db;
  message.dynamic_range_db = scanner.dynamic_range_db;
  message.tgc_extra_db_per_cm = scanner.tgc_extra_db_per_cm;
  message.focus_mm = scanner.focus_mm;
  message.probe_depth_mm = scanner.probe_depth_mm;
  message.probe_rotation_deg = scanner.probe_rotation_deg;
  return message;
}

ClientOptions client_options(const BrachydOptions& given) {
  if (given.struct_size < sizeof(BrachydOptions))
    throw UserError("BrachydOptions: call brachyd_init_options first");
  if (given.role < kBrachydViewer || given.role > kBrachydOperator)
    throw UserError("BrachydOptions.role must be kBrachydViewer, kBrachydDevice or kBrachydOperator");
  if (!is_wait(given.timeout_s) || given.timeout_s == 0)
    throw UserError("BrachydOptions.timeout_s must be above 0 and at most 3600");
  if (given.needle > kBrachydAnyNeedle)
    throw UserError("BrachydOptions.needle must be at most 65535, which is any");
  if (!std::memchr(given.name, 0, sizeof given.name) || !std::memchr(given.tls_ca, 0, sizeof given.tls_ca))
    throw UserError("BrachydOptions: a text does not end");
  ClientOptions options;
  options.role = static_cast<Role>(given.role);
  options.subscription = given.subscription;
  options.limits = {given.max_force_n, given.max_stiffness_n_per_mm, given.damping_n_s_per_mm, given.rate_hz};
  options.needle = static_cast<std::uint16_t>(given.needle);
  options.name = given.name;
  if (given.has_token) {
    options.token.emplace();
    std::memcpy(options.token->data(), given.token, sizeof given.token);
  }
  if (given.tls) options.tls = make_client_context({given.tls_ca, {}, {}});
  options.connect_timeout = in_ms(given.timeout_s);
  return options;
}

bool is_wait(double seconds) {
  return seconds >= 0 && seconds <= kLongestWaitS;  // not a NaN either
}

std::chrono::milliseconds in_ms(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(std::ceil(1e3 * seconds)));
}

}  // namespace brachy::net::c_api
