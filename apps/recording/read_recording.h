#pragma once

#include <functional>

#include "apps/recording/recording_file.h"
#include "net/server_messages.h"

namespace brachy {

/// Hands every message of a recording to `messages`, up to its end or its damage, and calls `after_each`. Throws UserError,
/// naming the byte, where the messages are whole but not what a server says.
void read_recording(RecordingReader& reader, net::ServerMessages& messages,
                    const std::function<void()>& after_each = {});

/// Tells where in a server's messages its simulation began anew (RESET): seeds, needles and ticks start over there.
class RunStarts {
 public:
  void add(const net::EventMessage& event);
  /// Once a FRAME, in order: whether it is the first of another run than the one before it.
  bool is_first_of_a_run(const net::FrameMessage& frame);

 private:
  bool has_frame_ = false;
  std::uint64_t last_tick_ = 0;
  int told_ = 0;  // events whose frame is to come; below 0: frames whose event is
};

/// Tells where in a server's messages its model became another (MODEL).
class ModelChanges {
 public:
  /// Once a STATE, in order: whether the model is another than in the one before it.
  bool is_another(const net::StateMessage& state);
  const net::ControlsState& model() const {
    return last_;
  }  ///< the newest; its kernel is empty where none was told

 private:
  net::ControlsState last_;
};

}  // namespace brachy
