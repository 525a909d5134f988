#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>

#include "net/wire/codec.h"
#include "net/wire/frame_assembler.h"
#include "net/wire/messages.h"

namespace brachy::net {

/// What a server's messages are handed to, in the order they came. Empty ones are skipped.
struct MessageHandlers {
  /// Every message as it came, before its own handler is called. Not PING, and none of a type that this version does not
  /// know. `body` is valid during the call.
  std::function<void(const Header&, std::span<const std::byte> body)> on_message;
  std::function<void(const WelcomeMessage&)> on_welcome;
  std::function<void(const TopologyMessage&)> on_topology;
  std::function<void(const FrameMessage&)> on_frame;  ///< after it was applied to mesh()
  std::function<void(const StateMessage&)> on_state;
  std::function<void(const EventMessage&)> on_event;
  std::function<void(const ErrorMessage&)> on_error;
  std::function<void(const DoseMessage&)> on_dose;
  std::function<void(const SceneMessage&)> on_scene;
  std::function<void(const ForceMessage&)> on_force;  ///< of several at once only the last is current
  std::function<void(const LocalModelMessage&)> on_local_model;  ///< likewise
};

/// Decodes and checks what a server sends, from a connection or a recording, and keeps the mesh that it makes.
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
  void count(const FrameMessage& frame);

  MessageHandlers handlers_;
  FrameAssembler mesh_;
  FrameMessage frame_;  // the last, for its memory
  std::uint64_t frames_ = 0, snapshots_missed_ = 0, last_snapshot_ = 0;
};

}  // namespace brachy::net
