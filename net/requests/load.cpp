// LOAD: an operator loads a needle with the seeds of one of the plan's.
#include "net/requests/request.h"
#include "net/wire/fields.h"

namespace brachy::net {

void fields(auto& archive, MaybeConst<LoadMessage> auto& message) {
  archive.u16(message.needle);
  archive.u16(message.plan_needle);
  archive.reserved(4);
}
BRACHY_CODEC(LoadMessage);

Refusal handle_load(const IncomingRequest& request) {
  LoadMessage load;
  if (auto refusal = request.decode(load)) return refusal;
  if (auto refusal = request.refuse_others("LOAD")) return refusal;
  if (auto refusal = request.refuse_needle(load.needle)) return refusal;
  if (auto refusal = request.refuse_changes(ErrorCode::kLoadRefused)) return refusal;
  return request.call(load, ErrorCode::kLoadRefused, "this server loads no needles");
}

}  // namespace brachy::net
