#include "net/server_messages.h"

namespace brachy::net {

std::string_view ServerMessages::take(const Header& header, std::span<const std::byte> body) {
  // Decodes, checks the message against those before it, and hands it on.
  const auto hand_on = [&](auto& message, const auto& handler, auto&& check) -> std::string_view {
    if (const DecodeResult result = decode_body(body, message); !result.is_good()) return result.reason;
    if (const std::string_view why = check(); !why.empty()) return why;
    if (handlers_.on_message) handlers_.on_message(header, body);
    if (handler) handler(message);
    return {};
  };
  const auto is_fine = [] { return std::string_view(); };
  const auto decode = [&]<class Message>(const std::function<void(const Message&)>& handler) {
    Message message;
    return hand_on(message, handler, is_fine);
  };
  switch (header.type) {
    case MessageType::kWelcome:
      return decode(handlers_.on_welcome);
    case MessageType::kTopology: {
      TopologyMessage topology;
      return hand_on(topology, handlers_.on_topology, [&] { return mesh_.start(topology); });
    }
    case MessageType::kFrame:
      return hand_on(frame_, handlers_.on_frame, [&] {
        const std::string_view why = mesh_.apply(frame_);
        if (why.empty()) count(frame_);
        return why;
      });
    case MessageType::kState:
      return decode(handlers_.on_state);
    case MessageType::kEvent:
      return decode(handlers_.on_event);
    case MessageType::kError:
      return decode(handlers_.on_error);
    case MessageType::kForce:
      return decode(handlers_.on_force);
    case MessageType::kLocalModel:
      return decode(handlers_.on_local_model);
    case MessageType::kDose:
      return decode(handlers_.on_dose);
    case MessageType::kScene:
      return decode(handlers_.on_scene);
    case MessageType::kPing:
      return {};
    case MessageType::kHello:
    case MessageType::kPose:
    case MessageType::kArm:
    case MessageType::kDrop:
    case MessageType::kControl:
      return "only a client sends messages of this type";
  }
  return {};  // a later version's
}

void ServerMessages::count(const FrameMessage& frame) {
  if (frames_ > 0 && frame.snapshot_sequence > last_snapshot_)
    snapshots_missed_ += frame.snapshot_sequence - last_snapshot_ - 1;
  last_snapshot_ = frame.snapshot_sequence;
  ++frames_;
}

}  // namespace brachy::net
