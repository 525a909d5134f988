#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "haptics/devices/hand_device.h"
#include "haptics/devices/hand_loop.h"
#include "net/wire/messages.h"

namespace brachy {

/// The command line of an adapter: HOST:PORT [--needle N] [--token FILE] [--scale S] [--start X,Y,Z] [--seconds S], and
/// options of the device's own, each with a value.
struct AdapterLine {
  std::string host;
  std::uint16_t port = 0;
  std::uint16_t needle = net::kAnyNeedle;
  std::optional<net::Token> token;
  std::optional<double> seconds;  ///< none: until a signal or a loss
  HandMapping mapping;
  std::map<std::string, std::string> own;
};

/// Throws UserError with `usage` where the words are none of these, and with the option and its limits where a value is
/// out of them (port 1 to 65535, needle 0 to 1023, scale 0.01 to 100).
AdapterLine adapter_line(int argc, char** argv, const std::string& usage,
                         const std::set<std::string>& own_options);

/// The rest of an adapter's program: connects as a device with the local model, runs HandLoop at the device's
/// rate until SIGINT, SIGTERM, the time's end or a loss, renders 0 N at the end, and prints how regular the cycles
/// were.
/// Returns the exit code: 0 ended as asked, 1 daemon or device lost. Throws UserError where nobody listens.
int run_hand_adapter(HandDevice& device, const AdapterLine& line);

}  // namespace brachy
