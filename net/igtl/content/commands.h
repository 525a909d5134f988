#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "net/requests/request.h"

namespace brachy::net::igtl {

/// Who sent a command, and what it is judged by: the rights, rates and handlers of the native protocol's requests.
struct CommandSource {
  const RequestServer& server;
  RateLimits& rates;  ///< of the client
  std::int64_t received_ns = 0;
  Sender sender;                                      ///< an operator
  std::function<bool(std::uint16_t needle)> is_held;  ///< the client is that needle's device
};

/// Carries out what a STRING or COMMAND asks: "reset", "play", "play loop", "stop", "model NAME [SUPPORT_MM]", "arm N"
/// or "drop N" (N: a needle, 0 where it is left out), as the native protocol's CONTROL, ARM and DROP. Untrusted input.
/// Returns the ERROR that the native protocol would answer with; nullopt: done, or, while sender.send_error is kept,
/// being done.
Refusal execute_command(std::string_view text, const CommandSource& source);

}  // namespace brachy::net::igtl
