#pragma once

#include <utility>
#include <vector>

#include "net/wire/codec.h"
#include "net/wire/message_parser.h"

namespace brachy::net::test {

/// The messages of the golden bytes in net/PROTOCOL.md.
HelloMessage sample_hello();
HelloMessage sample_hello_with_token();
HelloMessage sample_hello_with_images();
WelcomeMessage sample_welcome();
TopologyMessage sample_topology();
FrameMessage sample_frame();
PoseMessage sample_pose();
StateMessage sample_state();
EventMessage sample_event();
ErrorMessage sample_error();
PingMessage sample_ping();
ForceMessage sample_force();
LocalModelMessage sample_local_model();
ArmMessage sample_arm();
DropMessage sample_drop();
LoadMessage sample_load();
ExerciseMessage sample_exercise();
PlanMessage sample_plan();
DoseMessage sample_dose_with_planned();
DoseMessage sample_dose();
ControlMessage sample_control();
SceneMessage sample_scene();
ImageMessage sample_image();
ScannerMessage sample_scanner();
ContourMessage sample_contour();
Seed sample_seed();

template <class Message>
Bytes body_of(const Message& message) {
  Bytes body;
  encode_body(message, body);
  return body;
}

/// Type and body of each sample.
std::vector<std::pair<MessageType, Bytes>> sample_bodies();

/// Decodes a body of any type. `reencoded` receives the message's encoding where it was valid, `held_bytes` the
/// approximate memory of the decoded message.
DecodeResult decode_any(MessageType type, std::span<const std::byte> body, Bytes& reencoded,
                        std::size_t& held_bytes);

}  // namespace brachy::net::test
