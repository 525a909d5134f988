#include "net/client/server_messages.h"

namespace brachy::net {

template <class Message>
std::string_view ServerMessages::take_as(Message& message, const Handler<Message>& handler,
                                         const Header& header, std::span<const std::byte> body) {
  if (const DecodeResult result = decode_body(body, message); !result.is_good()) return result.reason;
  if (const std::string_view reason = apply(message); !reason.empty()) return reason;
  if (handlers_.on_message) handlers_.on_message(header, body);
  if (handler) handler(message);
  return {};
}

std::string_view ServerMessages::take(const Header& header, std::span<const std::byte> body) {
  if (only_clients_send(header.type)) return "only a client sends messages of this type";
  std::string_view reason;
  const auto take_if_it_is = [&]<class Message>(const Handler<Message>& handler) {
    if (header.type != Message::kType) return false;
    if constexpr (std::same_as<Message, FrameMessage>) {
      reason = take_as(frame_, handler, header, body);
    } else {
      Message message;
      reason = take_as(message, handler, header, body);
    }
    return true;
  };
  // PING, and what a later version sends, has no handler and is skipped.
  std::apply([&](const auto&... handler) { (... || take_if_it_is(handler)); }, handlers_.by_type());
  return reason;
}

std::string_view ServerMessages::apply(const TopologyMessage& topology) {
  return mesh_.start(topology);
}

std::string_view ServerMessages::apply(const FrameMessage& frame) {
  const std::string_view reason = mesh_.apply(frame);
  if (!reason.empty()) return reason;
  if (frames_ > 0 && frame.snapshot_sequence > last_snapshot_)
    snapshots_missed_ += frame.snapshot_sequence - last_snapshot_ - 1;
  last_snapshot_ = frame.snapshot_sequence;
  ++frames_;
  return {};
}

}  // namespace brachy::net
