// SCANNER: what is set at the ultrasound scanner, and the request of an operator or of the probe's device to change it.
#include "net/requests/request.h"
#include "net/wire/fields.h"

namespace brachy::net {

void fields(auto& archive, MaybeConst<ScannerMessage> auto& message) {
  archive.u16(message.array);
  archive.u16(message.freeze);
  archive.u32(message.flags);
  archive.u64(message.tick);
  for (auto* number :
       {&message.depth_mm, &message.gain_db, &message.dynamic_range_db, &message.tgc_extra_db_per_cm,
        &message.focus_mm, &message.probe_depth_mm, &message.probe_rotation_deg})
    archive.f64(*number);
  archive.sections();
}
BRACHY_CODEC(ScannerMessage);

Refusal handle_scanner(const IncomingRequest& request) {
  ScannerMessage scanner;
  if (auto refusal = request.decode(scanner)) return refusal;
  const bool is_probe =
      request.sender.role == Role::kDevice && request.sender.needle == request.server.probe_needle;
  if (request.sender.role != Role::kOperator && !is_probe)
    return request.refuse(ErrorCode::kNotOperator,
                          "only a client with the role operator, or the probe's device, may send SCANNER");
  if (!request.pass({"SCANNER", 30, 30}))
    return request.refuse(ErrorCode::kScannerRefused, "more than 30 SCANNERs a second");
  return request.call(scanner, ErrorCode::kScannerRefused, kNoScanner);
}

}  // namespace brachy::net
