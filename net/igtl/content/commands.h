#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "net/requests/request.h"

namespace brachy::net::igtl {

/// Carries out what a STRING or COMMAND asks: "reset", "play", "play loop", "stop", "model NAME [SUPPORT_MM]", "arm N"
/// or "drop N" (N: a needle, 0 where it is left out, below `needles`), by the handlers of the native protocol's
/// CONTROL, ARM and DROP. Untrusted input. `client`: its address, for logs. Returns the error to send; empty: done.
std::string execute_command(std::string_view text, std::size_t needles, const RequestHandlers& handlers,
                            const std::string& client);

}  // namespace brachy::net::igtl
