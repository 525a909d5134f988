// DROP: the button of a needle's device, or an operator's where the device is the daemon's own.
#include "net/requests/request.h"
#include "net/wire/fields.h"

namespace brachy::net {

void fields(auto& archive, MaybeConst<DropMessage> auto& message) {
  archive.u16(message.needle);
  archive.u8_bool(message.pressed, "pressed is neither 0 nor 1");
  archive.reserved(5);
}
BRACHY_CODEC(DropMessage);

Refusal handle_drop(const IncomingRequest& request) {
  DropMessage drop;
  if (auto refusal = request.decode(drop)) return refusal;
  if (!request.pass({"DROP", 100, 100}))
    return ErrorMessage{ErrorCode::kProtocol, true, 0, request.header.sequence,
                        "more than 100 DROPs a second"};
  if (auto refusal = request.refuse_needle(drop.needle)) return refusal;
  if (drop.needle == request.server.probe_needle)
    return request.refuse(ErrorCode::kNoNeedle, "the probe carries no seeds");
  const bool is_device = request.sender.role == Role::kDevice && drop.needle == request.sender.needle;
  const bool is_operator = request.sender.role == Role::kOperator;
  if (!is_device && !(is_operator && request.server.is_own_device(drop.needle)))
    return request.refuse(
        ErrorCode::kNotDevice,
        "only the device of needle " + std::to_string(drop.needle) +
            " drops its seeds; an operator does where the daemon's own device has the needle",
        kRefusedNotDevice);
  request.server.handlers.call(drop, request.sender);
  return std::nullopt;
}

}  // namespace brachy::net
