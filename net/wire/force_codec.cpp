// What a haptic device is sent: FORCE and LOCAL_MODEL.
#include "net/wire/force_fields.h"

namespace brachy::net {
namespace {

/// Friction that never slips, or a capsule that never breaks, has an infinite bound.
void bound(auto& archive, auto& value) {
  archive.f64(value);
  archive.check(!std::isnan(value), "a bound of the force is NaN");
}

}  // namespace

void fields(auto& archive, MaybeConst<ForceMessage> auto& message) {
  archive.u16(message.needle);
  archive.u16(message.flags);
  archive.u16(message.valid_ms);
  archive.reserved(2);
  archive.u64(message.tick);
  archive.u64(message.input_sequence);
  archive.time(message.input_stamp_ns);
  needle_forces_fields(archive, message.forces);
}
BRACHY_CODEC(ForceMessage);

void fields(auto& archive, MaybeConst<LocalModelMessage> auto& message) {
  auto& model = message.model;
  archive.u16(message.needle);
  archive.u16(message.flags);
  archive.u16_bits(model.in_contact, model.is_capsule, model.is_stuck);
  archive.reserved(2);
  archive.u64(model.tick);
  archive.u64(message.input_sequence);
  archive.time(message.input_stamp_ns);
  finite_vec3(archive, model.reference_tip);
  finite_vec3(archive, model.contact_point);
  finite_vec3(archive, model.axis);
  finite_force(archive, model.axial_stiffness_n_per_mm);
  bound(archive, model.axial_min_n);
  bound(archive, model.axial_max_n);
  bound(archive, model.after_puncture_n);
  finite_vec3(archive, model.lateral_n);
  finite_force(archive, model.lateral_stiffness_n_per_mm);
  finite_force(archive, model.time_to_live_s);
  finite_force(archive, message.max_force_n);
  finite_force(archive, message.max_stiffness_n_per_mm);
  finite_force(archive, message.max_slew_n_per_ms);
  finite_force(archive, message.ramp_s);
}
BRACHY_CODEC(LocalModelMessage);

}  // namespace brachy::net
