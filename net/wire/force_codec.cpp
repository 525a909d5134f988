#include "net/wire/force_codec.h"

#include <cmath>

#include "net/wire/codec.h"

namespace brachy::net {
namespace {

// Bits of LOCAL_MODEL's `contact`.
constexpr std::uint16_t kInContact = 1;
constexpr std::uint16_t kIsCapsule = 2;
constexpr std::uint16_t kIsStuck = 4;

double finite_force(ByteReader& reader) {
  const double value = reader.f64();
  if (!std::isfinite(value)) reader.fail("a force, a place or a limit is not finite");
  return value;
}

Vec3 finite_vec3(ByteReader& reader) {
  Vec3 v;
  for (int axis = 0; axis < 3; ++axis) v(axis) = finite_force(reader);
  return v;
}

/// What never slips or never breaks has an infinite bound.
double bound(ByteReader& reader) {
  const double value = reader.f64();
  if (std::isnan(value)) reader.fail("a bound of the force is NaN");
  return value;
}

}  // namespace

void write_needle_forces(ByteWriter& writer, const NeedleForces& forces) {
  writer.vec3(forces.force_n);
  writer.vec3(forces.tip_torque_nmm);
  writer.vec3(forces.hub_torque_nmm);
  writer.f64(forces.axial_n);
  writer.f64(forces.lateral_n);
  writer.f64(forces.cutting_n);
  writer.f64(forces.friction_n);
}

NeedleForces read_needle_forces(ByteReader& reader) {
  NeedleForces forces;
  forces.force_n = finite_vec3(reader);
  forces.tip_torque_nmm = finite_vec3(reader);
  forces.hub_torque_nmm = finite_vec3(reader);
  forces.axial_n = finite_force(reader);
  forces.lateral_n = finite_force(reader);
  forces.cutting_n = finite_force(reader);
  forces.friction_n = finite_force(reader);
  return forces;
}

void encode_body(const ForceMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u16(message.needle);
  writer.u16(message.flags);
  writer.u32(0);
  writer.u64(message.tick);
  writer.u64(message.input_sequence);
  writer.time(message.input_stamp_ns);
  write_needle_forces(writer, message.forces);
}

DecodeResult decode_body(std::span<const std::byte> body, ForceMessage& message) {
  ByteReader reader(body);
  message.needle = reader.u16();
  message.flags = reader.u16();
  reader.u32();
  message.tick = reader.u64();
  message.input_sequence = reader.u64();
  message.input_stamp_ns = reader.time();
  message.forces = read_needle_forces(reader);
  return DecodeResult::of(reader);
}

void encode_body(const LocalModelMessage& message, Bytes& out) {
  const LocalContactModel& model = message.model;
  ByteWriter writer(out);
  writer.u16(message.needle);
  writer.u16(message.flags);
  writer.u16(static_cast<std::uint16_t>((model.in_contact ? kInContact : 0) |
                                        (model.is_capsule ? kIsCapsule : 0) |
                                        (model.is_stuck ? kIsStuck : 0)));
  writer.u16(0);
  writer.u64(model.tick);
  writer.u64(message.input_sequence);
  writer.time(message.input_stamp_ns);
  writer.vec3(model.reference_tip);
  writer.vec3(model.contact_point);
  writer.vec3(model.axis);
  writer.f64(model.axial_stiffness_n_per_mm);
  writer.f64(model.axial_min_n);
  writer.f64(model.axial_max_n);
  writer.f64(model.after_puncture_n);
  writer.vec3(model.lateral_n);
  writer.f64(model.lateral_stiffness_n_per_mm);
  writer.f64(model.time_to_live_s);
  writer.f64(message.max_force_n);
  writer.f64(message.max_stiffness_n_per_mm);
  writer.f64(message.max_slew_n_per_ms);
  writer.f64(message.ramp_s);
}

DecodeResult decode_body(std::span<const std::byte> body, LocalModelMessage& message) {
  LocalContactModel& model = message.model;
  ByteReader reader(body);
  message.needle = reader.u16();
  message.flags = reader.u16();
  const std::uint16_t contact = reader.u16();
  model.in_contact = (contact & kInContact) != 0;
  model.is_capsule = (contact & kIsCapsule) != 0;
  model.is_stuck = (contact & kIsStuck) != 0;
  reader.u16();
  model.tick = reader.u64();
  message.input_sequence = reader.u64();
  message.input_stamp_ns = reader.time();
  model.reference_tip = finite_vec3(reader);
  model.contact_point = finite_vec3(reader);
  model.axis = finite_vec3(reader);
  model.axial_stiffness_n_per_mm = finite_force(reader);
  model.axial_min_n = bound(reader);
  model.axial_max_n = bound(reader);
  model.after_puncture_n = bound(reader);
  model.lateral_n = finite_vec3(reader);
  model.lateral_stiffness_n_per_mm = finite_force(reader);
  model.time_to_live_s = finite_force(reader);
  message.max_force_n = finite_force(reader);
  message.max_stiffness_n_per_mm = finite_force(reader);
  message.max_slew_n_per_ms = finite_force(reader);
  message.ramp_s = finite_force(reader);
  return DecodeResult::of(reader);
}

void encode_body(const ArmMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u16(message.needle);
  writer.u16(0);
  writer.u32(0);
}

DecodeResult decode_body(std::span<const std::byte> body, ArmMessage& message) {
  ByteReader reader(body);
  message.needle = reader.u16();
  reader.u16();
  reader.u32();
  return DecodeResult::of(reader);
}

}  // namespace brachy::net
