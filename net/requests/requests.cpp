#include <algorithm>
#include <iterator>

#include "net/requests/request.h"

namespace brachy::net {

// Each in the source file of its name. scripts/ci/wire_constants.py compares the table with net/protocol.json.
Request handle_arm, handle_contour, handle_control, handle_drop, handle_exercise, handle_load, handle_plan,
    handle_pose, handle_scanner;

namespace {

struct Entry {
  MessageType type;
  Request* request;
};
constexpr Entry kRequests[] = {
    {MessageType::kArm, handle_arm},           {MessageType::kContour, handle_contour},
    {MessageType::kControl, handle_control},   {MessageType::kDrop, handle_drop},
    {MessageType::kExercise, handle_exercise}, {MessageType::kLoad, handle_load},
    {MessageType::kPlan, handle_plan},         {MessageType::kPose, handle_pose},
    {MessageType::kScanner, handle_scanner},
};

}  // namespace

Request* find_request(MessageType type) {
  const auto* const found = std::ranges::find(kRequests, type, &Entry::type);
  return found == std::end(kRequests) ? nullptr : found->request;
}

Refusal IncomingRequest::refuse_needle(std::uint16_t needle) const {
  if (needle < server.needles) return std::nullopt;
  return refuse(ErrorCode::kNoNeedle, "there is no needle " + std::to_string(needle) + ": needles are 0 to " +
                                          std::to_string(server.needles - 1));
}

Refusal IncomingRequest::refuse_changes(ErrorCode code) const {
  if (pass({"changes", 10, 10})) return std::nullopt;
  return refuse(code, "more than 10 CONTROLs, LOADs and PLANs a second");
}

PoseVerdict verdict_beyond_rate(std::uint32_t max_poses_per_s) {
  return {false, kRefusedRate, "more than " + std::to_string(max_poses_per_s) + " poses a second"};
}

Refusal IncomingRequest::refuse_others(const std::string& what) const {
  if (sender.role == Role::kOperator) return std::nullopt;
  const std::string where = server.devices_at.empty() ? "" : ": operators connect to " + server.devices_at;
  return refuse(ErrorCode::kNotOperator, "only a client with the role operator may send " + what + where);
}

}  // namespace brachy::net
