// ARM: the device of a needle, or an operator, ends its latched fault.
#include "net/requests/request.h"
#include "net/wire/fields.h"

namespace brachy::net {

void fields(auto& archive, MaybeConst<ArmMessage> auto& message) {
  archive.u16(message.needle);
  archive.reserved(6);
}
BRACHY_CODEC(ArmMessage);

Refusal handle_arm(const IncomingRequest& request) {
  ArmMessage arm;
  if (auto refusal = request.decode(arm)) return refusal;
  if (auto refusal = request.refuse_needle(arm.needle)) return refusal;
  if (request.sender.role != Role::kOperator && arm.needle != request.sender.needle)
    return request.refuse(ErrorCode::kNotDevice,
                          "only the device of needle " + std::to_string(arm.needle) +
                              " or a client with the role operator may arm it",
                          kRefusedNotDevice);
  if (!request.pass({"ARM", 10, 10})) {
    // A hand that arms until its force comes back must not be drowned in answers, which would end its connection.
    if (!request.is_always_answered && !request.pass({"refused ARM", 10, 10})) return std::nullopt;
    return request.refuse(ErrorCode::kControlRefused, "more than 10 ARMs a second");
  }
  request.server.handlers.call(arm, request.sender);
  return std::nullopt;
}

}  // namespace brachy::net
