#pragma once

#include "net/wire/byte_io.h"
#include "net/wire/messages.h"

namespace brachy::net {

// The sections SEEDS and BUTTONS of a FRAME, head included.

/// `message.has_seeds` is given.
void write_seeds(ByteWriter& writer, const FrameMessage& message);
void read_seeds(ByteReader& reader, FrameMessage& message);

/// Ticks in which a needle's button was held, as the section has them.
struct HeldTicks {
  std::uint16_t needle = 0;
  std::uint64_t first = 0;
  std::uint32_t count = 0;
};
/// Of all needles in the frame's histories.
std::vector<HeldTicks> held_ticks(const FrameMessage& message);
void write_buttons(ByteWriter& writer, const std::vector<HeldTicks>& held);
std::vector<HeldTicks> read_buttons(ByteReader& reader);
/// Sets TickPose::button in the frame's histories.
void apply_buttons(const std::vector<HeldTicks>& held, FrameMessage& message);

}  // namespace brachy::net
