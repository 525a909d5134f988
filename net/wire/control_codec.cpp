#include <algorithm>

#include "net/wire/codec.h"
#include "net/wire/sections.h"

namespace brachy::net {
namespace {

constexpr std::uint16_t kDeviceSection = 1;  // of HELLO and of WELCOME
constexpr std::uint16_t kTokenSection = 2;   // of HELLO
constexpr std::uint16_t kSoftwareSection = 3;
constexpr std::uint16_t kSafetySection = 1;  // of STATE
constexpr std::uint16_t kControlsSection = 2;

Role read_role(ByteReader& reader) {
  const std::uint16_t role = reader.u16();
  if (role < 1 || role > 3) reader.fail("the role is none of viewer (1), device (2), operator (3)");
  return reader.ok() ? static_cast<Role>(role) : Role::kViewer;
}

bool read_bool(ByteReader& reader) {
  const std::uint8_t value = reader.u8();
  if (value > 1) reader.fail("a yes/no field is neither 0 nor 1");
  return value == 1;
}

void read_token(ByteReader& reader, HelloMessage& message) {
  const auto bytes = reader.take(kTokenBytes);
  if (bytes.size() == kTokenBytes) std::ranges::copy(bytes, message.token.emplace().begin());
}

void write_quantiles(ByteWriter& writer, const Quantiles& q) {
  writer.u64(q.count);
  writer.f64(q.p50);
  writer.f64(q.p99);
  writer.f64(q.p999);
  writer.f64(q.max);
}

void write_safety(const std::vector<SafetyCount>& counts, Bytes& out) {
  ByteWriter writer(out);
  writer.u16(static_cast<std::uint16_t>(counts.size()));
  writer.u16(0);
  for (const SafetyCount& count : counts) {
    writer.u16(count.needle);
    writer.u16(count.code);
    writer.u64(count.count);
    writer.text(count.text, kMaxTextBytes);
  }
}

void read_safety(ByteReader& reader, std::vector<SafetyCount>& counts) {
  const std::uint16_t size = reader.u16();
  reader.u16();
  counts.clear();  // the section may stand there twice: the last one counts
  if (reader.fits(size, 14)) counts.resize(size);
  for (SafetyCount& count : counts) {
    count.needle = reader.u16();
    count.code = reader.u16();
    count.count = reader.u64();
    count.text = reader.text(kMaxTextBytes);
  }
}

void write_controls(const ControlsState& controls, Bytes& out) {
  ByteWriter writer(out);
  writer.text(controls.kernel, kMaxNameBytes);
  writer.f64(controls.support_radius_mm);
  writer.u32(controls.flags);
}

void read_controls(ByteReader& reader, ControlsState& controls) {
  controls.kernel = reader.text(kMaxNameBytes);
  controls.support_radius_mm = reader.f64();
  controls.flags = reader.u32();
}

Quantiles read_quantiles(ByteReader& reader) {
  Quantiles q;
  q.count = reader.u64();
  q.p50 = reader.f64();
  q.p99 = reader.f64();
  q.p999 = reader.f64();
  q.max = reader.f64();
  return q;
}

}  // namespace

void encode_header(const Header& header, Bytes& out) {
  ByteWriter writer(out);
  writer.u32(kMagic);
  writer.u16(header.version);
  writer.u16(static_cast<std::uint16_t>(header.type));
  writer.u32(header.flags);
  writer.u32(header.length);
  writer.u64(header.sequence);
  writer.time(header.stamp_ns);
}

DecodeResult decode_header(std::span<const std::byte> bytes, std::uint32_t max_body_bytes, Header& header) {
  for (std::size_t i = 0; i < 4 && i < bytes.size(); ++i) {
    if (std::to_integer<std::uint32_t>(bytes[i]) != (kMagic >> (8 * i) & 0xFF)) {
      return DecodeResult::bad("not a brachyd message: the magic bytes 'BRCY' are missing");
    }
  }
  if (bytes.size() < kHeaderSize) return DecodeResult::need_more();
  ByteReader reader(bytes.first(kHeaderSize));
  reader.u32();
  header.version = reader.u16();
  header.type = static_cast<MessageType>(reader.u16());
  header.flags = reader.u32();
  header.length = reader.u32();
  header.sequence = reader.u64();
  header.stamp_ns = reader.time();
  if (header.version != kProtocolVersion) {
    return DecodeResult::bad("the protocol version is not 1", ErrorCode::kVersion);
  }
  if (header.length > max_body_bytes) {
    return DecodeResult::bad("the body is longer than the limit", ErrorCode::kTooLarge);
  }
  return DecodeResult::of(reader);
}

void encode_body(const HelloMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u16(static_cast<std::uint16_t>(message.role));
  writer.u16(0);
  writer.u32(message.subscription);
  writer.f64(message.limits.max_force_n);
  writer.f64(message.limits.max_stiffness_n_per_mm);
  writer.f64(message.limits.damping_n_s_per_mm);
  writer.f64(message.limits.rate_hz);
  writer.text(message.name, kMaxNameBytes);
  const bool has_device = message.needle != kAnyNeedle || message.device_flags != 0;
  writer.u32((has_device ? 1 : 0) + (message.token ? 1 : 0) + (message.software.empty() ? 0 : 1));
  if (has_device) {
    write_section_head(writer, kDeviceSection, 8);
    writer.u16(message.needle);
    writer.u16(message.device_flags);
    writer.u32(0);
  }
  if (message.token) {
    write_section_head(writer, kTokenSection, kTokenBytes);
    out.insert(out.end(), message.token->begin(), message.token->end());
  }
  if (!message.software.empty()) {
    Bytes payload;
    ByteWriter(payload).text(message.software, kMaxNameBytes);
    write_section_head(writer, kSoftwareSection, payload.size());
    out.insert(out.end(), payload.begin(), payload.end());
  }
}

DecodeResult decode_body(std::span<const std::byte> body, HelloMessage& message) {
  ByteReader reader(body);
  message.role = read_role(reader);
  reader.u16();
  message.subscription = reader.u32();
  message.limits.max_force_n = reader.f64();
  message.limits.max_stiffness_n_per_mm = reader.f64();
  message.limits.damping_n_s_per_mm = reader.f64();
  message.limits.rate_hz = reader.f64();
  message.name = reader.text(kMaxNameBytes);
  message.needle = kAnyNeedle;
  message.device_flags = 0;
  message.token.reset();
  message.software.clear();
  read_known_sections(reader, [&](std::uint16_t id, ByteReader& section) {
    if (id == kTokenSection) return read_token(section, message), true;
    if (id == kSoftwareSection) return message.software = section.text(kMaxNameBytes), true;
    if (id != kDeviceSection) return false;
    message.needle = section.u16();
    message.device_flags = section.u16();
    section.u32();
    return true;
  });
  return DecodeResult::of(reader);
}

void encode_body(const WelcomeMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u64(message.session);
  writer.u16(static_cast<std::uint16_t>(message.role));
  writer.u16(0);
  writer.u32(message.subscription);
  writer.f64(message.deformation_hz);
  writer.f64(message.snapshot_hz);
  writer.u32(message.max_message_bytes);
  writer.u32(message.max_poses_per_s);
  writer.u64(message.topology_hash);
  writer.text(message.server, kMaxNameBytes);
  writer.text(message.units, kMaxNameBytes);
  writer.text(message.frame, kMaxNameBytes);
  writer.u32(1);
  write_section_head(writer, kDeviceSection, 8);
  writer.u16(message.needle);
  writer.u16(message.needle_count);
  writer.u32(0);
}

DecodeResult decode_body(std::span<const std::byte> body, WelcomeMessage& message) {
  ByteReader reader(body);
  message.session = reader.u64();
  message.role = read_role(reader);
  reader.u16();
  message.subscription = reader.u32();
  message.deformation_hz = reader.f64();
  message.snapshot_hz = reader.f64();
  message.max_message_bytes = reader.u32();
  message.max_poses_per_s = reader.u32();
  message.topology_hash = reader.u64();
  message.server = reader.text(kMaxNameBytes);
  message.units = reader.text(kMaxNameBytes);
  message.frame = reader.text(kMaxNameBytes);
  message.needle = kAnyNeedle;
  message.needle_count = 1;
  read_known_sections(reader, [&](std::uint16_t id, ByteReader& section) {
    if (id != kDeviceSection) return false;
    message.needle = section.u16();
    message.needle_count = section.u16();
    section.u32();
    return true;
  });
  return DecodeResult::of(reader);
}

void encode_body(const PoseMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u16(message.needle);
  writer.u16(message.flags);
  writer.u32(0);
  writer.pose(message.X_WN);
}

DecodeResult decode_body(std::span<const std::byte> body, PoseMessage& message) {
  ByteReader reader(body);
  message.needle = reader.u16();
  message.flags = reader.u16();
  reader.u32();
  message.X_WN = reader.pose();
  return DecodeResult::of(reader);
}

void encode_body(const StateMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u64(message.ticks);
  writer.u64(message.overruns);
  writer.u64(message.control_overruns);
  write_quantiles(writer, message.tick_ms);
  write_quantiles(writer, message.lateness_ms);
  write_quantiles(writer, message.latency_ms);
  writer.u64(message.poses_accepted);
  writer.u64(message.snapshots);
  writer.u64(message.snapshots_sent);
  writer.u64(message.snapshots_dropped);
  writer.u32(message.clients);
  writer.u32(message.viewers);
  writer.u16(static_cast<std::uint16_t>(message.refusals.size()));
  writer.u16(0);
  for (const PoseRefusals& refusal : message.refusals) {
    writer.u64(refusal.count);
    writer.u16(refusal.code);
    writer.text(refusal.text, kMaxTextBytes);
  }
  writer.text(message.device_holder, kMaxTextBytes);
  std::vector<std::pair<std::uint16_t, Bytes>> sections;
  if (!message.safety.empty())
    write_safety(message.safety, sections.emplace_back(kSafetySection, Bytes()).second);
  if (!message.controls.kernel.empty())
    write_controls(message.controls, sections.emplace_back(kControlsSection, Bytes()).second);
  writer.u32(static_cast<std::uint32_t>(sections.size()));
  for (const auto& [id, payload] : sections) {
    write_section_head(writer, id, payload.size());
    out.insert(out.end(), payload.begin(), payload.end());
  }
}

DecodeResult decode_body(std::span<const std::byte> body, StateMessage& message) {
  ByteReader reader(body);
  message.ticks = reader.u64();
  message.overruns = reader.u64();
  message.control_overruns = reader.u64();
  message.tick_ms = read_quantiles(reader);
  message.lateness_ms = read_quantiles(reader);
  message.latency_ms = read_quantiles(reader);
  message.poses_accepted = reader.u64();
  message.snapshots = reader.u64();
  message.snapshots_sent = reader.u64();
  message.snapshots_dropped = reader.u64();
  message.clients = reader.u32();
  message.viewers = reader.u32();
  const std::uint16_t refusals = reader.u16();
  reader.u16();
  message.refusals.clear();
  if (reader.fits(refusals, 12)) message.refusals.resize(refusals);
  for (PoseRefusals& refusal : message.refusals) {
    refusal.count = reader.u64();
    refusal.code = reader.u16();
    refusal.text = reader.text(kMaxTextBytes);
  }
  message.device_holder = reader.text(kMaxTextBytes);
  message.safety.clear();
  message.controls = {};
  read_known_sections(reader, [&](std::uint16_t id, ByteReader& section) {
    if (id == kSafetySection) return read_safety(section, message.safety), true;
    if (id == kControlsSection) return read_controls(section, message.controls), true;
    return false;
  });
  return DecodeResult::of(reader);
}

void encode_body(const EventMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u16(static_cast<std::uint16_t>(message.kind));
  writer.u16(message.needle);
  writer.u32(0);
  writer.u64(message.tick);
  writer.text(message.text, kMaxTextBytes);
}

DecodeResult decode_body(std::span<const std::byte> body, EventMessage& message) {
  ByteReader reader(body);
  message.kind = static_cast<EventKind>(reader.u16());
  message.needle = reader.u16();
  reader.u32();
  message.tick = reader.u64();
  message.text = reader.text(kMaxTextBytes);
  return DecodeResult::of(reader);
}

void encode_body(const ErrorMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u16(static_cast<std::uint16_t>(message.code));
  writer.u8(message.fatal ? 1 : 0);
  writer.u8(0);
  writer.u16(message.reason);
  writer.u16(0);
  writer.u64(message.about_sequence);
  writer.text(message.text, kMaxTextBytes);
}

DecodeResult decode_body(std::span<const std::byte> body, ErrorMessage& message) {
  ByteReader reader(body);
  message.code = static_cast<ErrorCode>(reader.u16());
  message.fatal = read_bool(reader);
  reader.u8();
  message.reason = reader.u16();
  reader.u16();
  message.about_sequence = reader.u64();
  message.text = reader.text(kMaxTextBytes);
  return DecodeResult::of(reader);
}

void encode_body(const PingMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u64(message.nonce);
  writer.u8(message.reply ? 1 : 0);
  for (int i = 0; i < 7; ++i) writer.u8(0);
  writer.time(message.echoed_stamp_ns);
  writer.time(message.received_ns);
}

DecodeResult decode_body(std::span<const std::byte> body, PingMessage& message) {
  ByteReader reader(body);
  message.nonce = reader.u64();
  message.reply = read_bool(reader);
  for (int i = 0; i < 7; ++i) reader.u8();
  message.echoed_stamp_ns = reader.time();
  message.received_ns = reader.time();
  return DecodeResult::of(reader);
}

}  // namespace brachy::net
