#pragma once

#include <optional>

#include "apps/command_line/options.h"

namespace brachy {

/// The command line of brachyd. Where nothing is left to do (--help, --version, wrong usage, all already printed)
/// `exit_code` is set and the options are not valid.
DaemonOptions parse_daemon_line(int argc, char** argv, std::optional<int>& exit_code);

}  // namespace brachy
