#pragma once

#include "apps/options.h"

namespace brachy {

/// `brachyd doctor`: what this machine grants, and whether the scene is too heavy for it; the answer on standard output. Exit
/// code 0: the scene fits, 1: it does not. Throws UserError for a scene that is not good. Precondition: one thread.
int doctor(const DaemonOptions& options);

}  // namespace brachy
