// The header, and the messages of the connection: HELLO, WELCOME, STATE, EVENT, ERROR, PING.
#include "net/wire/codec.h"
#include "net/wire/fields.h"

namespace brachy::net {
namespace {

constexpr std::uint16_t kDeviceSection = 1;  // of HELLO and of WELCOME
constexpr std::uint16_t kLimitsSection = 2;  // of WELCOME
constexpr std::uint16_t kTokenSection = 2;   // of HELLO
constexpr std::uint16_t kSoftwareSection = 3;
constexpr std::uint16_t kImagesSection = 4;
constexpr std::uint16_t kSafetySection = 1;  // of STATE
constexpr std::uint16_t kControlsSection = 2;
constexpr std::uint16_t kDropsSection = 3;

constexpr std::string_view kNotYesOrNo = "a yes/no field is neither 0 nor 1";

void role_field(auto& archive, auto& role) {
  archive.u16(role);
  archive.check(role >= Role::kViewer && role <= Role::kOperator,
                "the role is none of viewer (1), device (2), operator (3)");
}

void quantiles_fields(auto& archive, auto& q) {
  archive.u64(q.count);
  archive.f64(q.p50);
  archive.f64(q.p99);
  archive.f64(q.p999);
  archive.f64(q.max);
}

/// The fields of the header that follow the magic bytes.
void header_fields(auto& archive, auto& header) {
  archive.u16(header.version);
  archive.u16(header.type);
  archive.u32(header.flags);
  archive.u32(header.length);
  archive.u64(header.sequence);
  archive.time(header.stamp_ns);
}

}  // namespace

void encode_header(const Header& header, Bytes& out) {
  FieldWriter archive(out);
  archive.u32(kMagic);
  header_fields(archive, header);
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
  FieldReader archive(reader);
  header_fields(archive, header);
  if (header.version != kProtocolVersion) {
    return DecodeResult::bad("the protocol version is not 1", ErrorCode::kVersion);
  }
  if (header.length > max_body_bytes) {
    return DecodeResult::bad("the body is longer than the limit", ErrorCode::kTooLarge);
  }
  return DecodeResult::of(reader);
}

template <class Archive>
void fields(Archive& archive, MaybeConst<HelloMessage> auto& message) {
  role_field(archive, message.role);
  archive.reserved(2);
  archive.u32(message.subscription);
  archive.f64(message.limits.max_force_n);
  archive.f64(message.limits.max_stiffness_n_per_mm);
  archive.f64(message.limits.damping_n_s_per_mm);
  archive.f64(message.limits.rate_hz);
  archive.text(message.name, kMaxNameBytes);
  const bool has_device = message.needle != kAnyNeedle || message.device_flags != 0;
  archive.sections(Section{kDeviceSection, has_device,
                           [&](auto& section) {
                             section.u16(message.needle);
                             section.u16(message.device_flags);
                             section.reserved(4);
                           }},
                   Section{kTokenSection, message.token.has_value(),
                           [&](auto& section) {
                             if constexpr (Archive::kReads) message.token.emplace();
                             section.bytes(*message.token);
                           }},
                   Section{kSoftwareSection, !message.software.empty(),
                           [&](auto& section) { section.text(message.software, kMaxNameBytes); }},
                   Section{kImagesSection, message.image_flags != 0, [&](auto& section) {
                             section.u16(message.image_flags);
                             section.reserved(6);
                           }});
}
BRACHY_CODEC(HelloMessage);

template <class Archive>
void fields(Archive& archive, MaybeConst<WelcomeMessage> auto& message) {
  archive.u64(message.session);
  role_field(archive, message.role);
  archive.reserved(2);
  archive.u32(message.subscription);
  archive.f64(message.deformation_hz);
  archive.f64(message.snapshot_hz);
  archive.u32(message.max_message_bytes);
  archive.u32(message.max_poses_per_s);
  archive.u64(message.topology_hash);
  archive.text(message.server, kMaxNameBytes);
  archive.text(message.units, kMaxNameBytes);
  archive.text(message.frame, kMaxNameBytes);
  archive.sections(Section{kDeviceSection, true,
                           [&](auto& section) {
                             section.u16(message.needle);
                             section.u16(message.needle_count);
                             section.reserved(4);
                           }},
                   Section{kLimitsSection, message.limits.has_value(), [&](auto& section) {
                             if constexpr (Archive::kReads) message.limits.emplace();
                             section.f64(message.limits->max_force_n);
                             section.f64(message.limits->max_stiffness_n_per_mm);
                             section.f64(message.limits->damping_n_s_per_mm);
                             section.f64(message.limits->rate_hz);
                             section.u32(message.limits->not_plausible);
                             section.reserved(4);
                           }});
}
BRACHY_CODEC(WelcomeMessage);

void fields(auto& archive, MaybeConst<StateMessage> auto& message) {
  archive.u64(message.ticks);
  archive.u64(message.overruns);
  archive.u64(message.control_overruns);
  quantiles_fields(archive, message.tick_ms);
  quantiles_fields(archive, message.lateness_ms);
  quantiles_fields(archive, message.latency_ms);
  archive.u64(message.poses_accepted);
  archive.u64(message.snapshots);
  archive.u64(message.snapshots_sent);
  archive.u64(message.snapshots_dropped);
  archive.u32(message.clients);
  archive.u32(message.viewers);
  archive.u16_list(message.refusals, 12, [&](auto& refusal) {
    archive.u64(refusal.count);
    archive.u16(refusal.code);
    archive.text(refusal.text, kMaxTextBytes);
  });
  archive.text(message.device_holder, kMaxTextBytes);
  archive.sections(Section{kSafetySection, !message.safety.empty(),
                           [&](auto& section) {
                             section.u16_list(message.safety, 14, [&](auto& count) {
                               section.u16(count.needle);
                               section.u16(count.code);
                               section.u64(count.count);
                               section.text(count.text, kMaxTextBytes);
                             });
                           }},
                   Section{kControlsSection, !message.controls.kernel.empty(),
                           [&](auto& section) {
                             section.text(message.controls.kernel, kMaxNameBytes);
                             section.f64(message.controls.support_radius_mm);
                             section.u32(message.controls.flags);
                           }},
                   Section{kDropsSection, message.events_dropped > 0,
                           [&](auto& section) { section.u64(message.events_dropped); }});
}
BRACHY_CODEC(StateMessage);

void fields(auto& archive, MaybeConst<EventMessage> auto& message) {
  archive.u16(message.kind);
  archive.u16(message.needle);
  archive.reserved(4);
  archive.u64(message.tick);
  archive.text(message.text, kMaxTextBytes);
}
BRACHY_CODEC(EventMessage);

void fields(auto& archive, MaybeConst<ErrorMessage> auto& message) {
  archive.u16(message.code);
  archive.u8_bool(message.fatal, kNotYesOrNo);
  archive.reserved(1);
  archive.u16(message.reason);
  archive.reserved(2);
  archive.u64(message.about_sequence);
  archive.text(message.text, kMaxTextBytes);
}
BRACHY_CODEC(ErrorMessage);

void fields(auto& archive, MaybeConst<PingMessage> auto& message) {
  archive.u64(message.nonce);
  archive.u8_bool(message.reply, kNotYesOrNo);
  archive.reserved(7);
  archive.time(message.echoed_stamp_ns);
  archive.time(message.received_ns);
}
BRACHY_CODEC(PingMessage);

}  // namespace brachy::net
