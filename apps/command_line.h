#pragma once

#include <optional>

#include "apps/options.h"

namespace brachy {

/// The programs' command lines. Where there is nothing left to do (--help, --version, wrong usage, all already
/// printed) `exit_code` is set, and what is returned means nothing.
DaemonOptions parse_daemon_line(int argc, char** argv, std::optional<int>& exit_code);
ToolOptions parse_tool_line(int argc, char** argv, std::optional<int>& exit_code);

}  // namespace brachy
