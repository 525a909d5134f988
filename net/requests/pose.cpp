// POSE: where a device holds its needle.
#include <algorithm>

#include "net/requests/request.h"
#include "net/wire/fields.h"

namespace brachy::net {

void fields(auto& archive, MaybeConst<PoseMessage> auto& message) {
  archive.u16(message.needle);
  archive.u16(message.flags);
  archive.reserved(4);
  archive.pose(message.X_WN);
}
BRACHY_CODEC(PoseMessage);

Refusal handle_pose(const IncomingRequest& request) {
  PoseMessage received;
  if (auto refusal = request.decode(received)) return refusal;
  const Sender& sender = request.sender;
  const RequestServer& server = request.server;
  constexpr Rate kMisuseReports{"POSE misused", 1, 1}, kRefusalReports{"POSE refused", 4, 4};
  const auto report = [&](const PoseVerdict& verdict, ErrorCode code, const Rate& reports) {
    return request.pass(reports) ? request.refuse(code, verdict.text, verdict.code) : std::nullopt;
  };
  const auto refuse = [&](const PoseVerdict& verdict, ErrorCode code, const Rate& reports) {
    server.refuse_pose(verdict, sender.needle == kAnyNeedle ? std::uint16_t{0} : sender.needle, sender.name);
    return report(verdict, code, reports);
  };
  if (sender.role != Role::kDevice)
    return refuse({false, kRefusedNotDevice, "only the client with the role device sends poses"},
                  ErrorCode::kNotDevice, kMisuseReports);
  if (!request.pass({"POSE", double(server.max_poses_per_s), std::max(1.0, server.max_poses_per_s / 10.0)}))
    return refuse(verdict_beyond_rate(server.max_poses_per_s), ErrorCode::kPoseRate, kMisuseReports);
  if (received.needle != sender.needle)
    return refuse({false, kRefusedNeedle,
                   "this device has needle " + std::to_string(sender.needle) + ": WELCOME says so"},
                  ErrorCode::kPoseRefused, kRefusalReports);
  NeedlePose pose;
  pose.X_WN = received.X_WN;
  pose.sequence = request.header.sequence;
  pose.stamp_ns = request.header.stamp_ns;
  pose.received_ns = request.received_ns;
  pose.present = true;
  const PoseVerdict verdict = server.submit(sender.needle, pose);
  return verdict.accepted ? std::nullopt : report(verdict, ErrorCode::kPoseRefused, kRefusalReports);
}

}  // namespace brachy::net
