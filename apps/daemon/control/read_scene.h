#pragma once

#include "apps/command_line/options.h"
#include "core/scene/scene.h"

namespace brachy {

/// The scene file of the options, changed by the options that override it and by `kernel = "auto"`; logs what
/// was chosen. Throws UserError for a file that is missing or wrong.
Scene read_scene(const DaemonOptions& options);

}  // namespace brachy
