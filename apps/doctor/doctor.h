#pragma once

#include "apps/command_line/options.h"

namespace brachy {

/// `brachyd doctor`: checks what this machine grants and whether it runs the scene in time; prints the answer
/// to standard output. Exit code 0: the scene fits, 1: it does not. Throws UserError for an invalid scene.
/// Precondition: one thread.
int doctor(const DaemonOptions& options);

}  // namespace brachy
