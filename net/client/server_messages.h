#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <tuple>

#include "net/wire/codec.h"
#include "net/wire/frame_assembler.h"
#include "net/wire/messages.h"

namespace brachy::net {

template <class Message>
using Handler = std::function<void(const Message&)>;

/// Called for the messages of a server, in the order received. Empty ones are skipped.
struct MessageHandlers {
  /// Every message as received, before its own handler is called; not PING, nor a type that this version does not know.
  /// `body` is valid during the call.
  std::function<void(const Header&, std::span<const std::byte> body)> on_message;
  Handler<WelcomeMessage> on_welcome;
  Handler<TopologyMessage> on_topology;
  Handler<FrameMessage> on_frame;  ///< after it was applied to mesh()
  Handler<StateMessage> on_state;
  Handler<EventMessage> on_event;
  Handler<ErrorMessage> on_error;
  Handler<DoseMessage> on_dose;
  Handler<SceneMessage> on_scene;
  Handler<ImageMessage> on_image;             ///< its pixels: net/wire/image_pixels.h
  Handler<PlanMessage> on_plan;               ///< in use
  Handler<ScannerMessage> on_scanner;         ///< what is set
  Handler<ContourMessage> on_contour;         ///< the answer to one of this client's
  Handler<ForceMessage> on_force;             ///< of several at once only the last is current
  Handler<LocalModelMessage> on_local_model;  ///< likewise

  /// All of one message type: what is listed here is decoded and handed over.
  auto by_type() const {
    return std::tie(on_welcome, on_topology, on_frame, on_state, on_event, on_error, on_dose, on_scene,
                    on_image, on_plan, on_scanner, on_contour, on_force, on_local_model);
  }
};

/// Decodes and checks the messages of a server, from a connection or a recording, and maintains the mesh they describe.
/// Threads: one.
class ServerMessages {
 public:
  explicit ServerMessages(MessageHandlers handlers) : handlers_(std::move(handlers)) {}

  /// The next message. Returns "" or why it is refused, a literal; no handler is called then.
  std::string_view take(const Header& header, std::span<const std::byte> body);

  const FrameAssembler& mesh() const { return mesh_; }
  std::uint64_t frames() const { return frames_; }
  std::uint64_t snapshots_missed() const { return snapshots_missed_; }  ///< gaps since the first frame

 private:
  template <class Message>
  std::string_view take_as(Message& message, const Handler<Message>& handler, const Header& header,
                           std::span<const std::byte> body);
  // Applies a message to the mesh; "" or why it is refused.
  template <class Message>
  std::string_view apply(const Message&) {
    return {};
  }
  std::string_view apply(const TopologyMessage& topology);
  std::string_view apply(const FrameMessage& frame);

  MessageHandlers handlers_;
  FrameAssembler mesh_;
  FrameMessage frame_;  // the last one; kept so that its arrays are reused
  std::uint64_t frames_ = 0, snapshots_missed_ = 0, last_snapshot_ = 0;
};

}  // namespace brachy::net
