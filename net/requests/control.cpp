// CONTROL: an operator plays, stops and resets the simulation, and changes its model.
#include "net/requests/request.h"
#include "net/wire/fields.h"

namespace brachy::net {

void fields(auto& archive, MaybeConst<ControlMessage> auto& message) {
  archive.u16(message.action);
  archive.u16_bits(message.loop);
  archive.reserved(4);
  archive.f64(message.support_radius_mm);
  archive.text(message.kernel, kMaxNameBytes);
  archive.sections();
}
BRACHY_CODEC(ControlMessage);

Refusal handle_control(const IncomingRequest& request) {
  ControlMessage control;
  if (auto refusal = request.decode(control)) return refusal;
  if (auto refusal = request.refuse_others("CONTROL")) return refusal;
  if (auto refusal = request.refuse_changes(ErrorCode::kControlRefused)) return refusal;
  auto refusal = request.call(control, ErrorCode::kControlRefused, "this server has no controls");
  if (!refusal) request.server.broadcast_state();
  return refusal;
}

}  // namespace brachy::net
