#include "apps/recording/read_recording.h"

#include "core/base/error.h"

namespace brachy {

void read_recording(RecordingReader& reader, net::ServerMessages& messages,
                    const std::function<void()>& after_each) {
  RecordingReader::Message message;
  const auto refuse = [&](std::string_view why) {
    throw UserError(reader.name() + ": the message at byte " + std::to_string(message.offset) +
                    " is intact, but no server sends it: " + std::string(why));
  };
  for (bool is_first = true; reader.next(message); is_first = false) {
    if (is_first && message.header.type != net::MessageType::kWelcome)
      refuse("the first message must be a WELCOME");
    if (const auto why = messages.take(message.header, message.body); !why.empty()) refuse(why);
    if (after_each) after_each();
  }
}

void RunStarts::add(const net::EventMessage& event) {
  if (event.kind == net::EventKind::kReset) ++pending_;
}

bool RunStarts::is_first_of_a_run(const net::FrameMessage& frame) {
  const bool is_first = has_frame_ && frame.full && (frame.tick < last_tick_ || pending_ > 0);
  if (is_first) --pending_;
  has_frame_ = true;
  last_tick_ = frame.tick;
  return is_first;
}

bool ModelChanges::is_another(const net::StateMessage& state) {
  const net::ControlsState& now = state.controls;
  if (now.kernel.empty()) return false;
  const bool is_known = !last_.kernel.empty();
  const bool is_same = now.kernel == last_.kernel && now.support_radius_mm == last_.support_radius_mm;
  last_ = now;
  return is_known && !is_same;
}

}  // namespace brachy
