#pragma once

#include <functional>

#include "apps/recording/recording_file.h"
#include "net/client/server_messages.h"

namespace brachy {

/// Passes every message of a recording to `messages`, up to its end or its damage, and calls `after_each`. Throws
/// UserError, naming the byte, where the messages are intact but not valid in a server's sequence.
void read_recording(RecordingReader& reader, net::ServerMessages& messages,
                    const std::function<void()>& after_each = {});

/// Finds the resets of the simulation in a server's messages (RESET): seeds, needles and ticks start over there.
class RunStarts {
 public:
  void add(const net::EventMessage& event);
  /// Call once per FRAME, in order. Returns whether the frame is the first of a new run.
  bool is_first_of_a_run(const net::FrameMessage& frame);

 private:
  bool has_frame_ = false;
  std::uint64_t last_tick_ = 0;
  int pending_ = 0;  // > 0: reset events whose frame is still to come; < 0: frames whose event is
};

/// Finds the changes of the model in a server's messages (MODEL).
class ModelChanges {
 public:
  /// Call once per STATE, in order. Returns whether the model differs from that of the previous one.
  bool is_another(const net::StateMessage& state);
  const net::ControlsState& model() const {
    return last_;
  }  ///< the newest; its kernel is empty where none was sent

 private:
  net::ControlsState last_;
};

}  // namespace brachy
