#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "net/wire/messages.h"

namespace brachy::net::igtl {

/// What a STRING or COMMAND may do: the native protocol's CONTROL, ARM and DROP, with the same rules.
struct CommandHandlers {
  /// Empty: done; else why not. `client`: its address, for logs.
  std::function<std::string(const ControlMessage&, const std::string& client)> on_control;
  std::function<void(std::uint16_t needle, const std::string& client)> on_arm;
  std::function<void(std::uint16_t needle, bool pressed)> on_drop;
};

/// Carries out "reset", "play", "play loop", "stop", "model NAME [SUPPORT_MM]", "arm N" or "drop N" (N: a needle, 0
/// where it is left out, below `needles`). Untrusted input. Returns the error to send; empty: done.
std::string execute_command(std::string_view text, std::size_t needles, const CommandHandlers& handlers,
                            const std::string& client);

}  // namespace brachy::net::igtl
