#pragma once

#include "core/scene/scene.h"
#include "core/scene/toml_table.h"

namespace brachy {

/// Reads [template], [seeds], [plan], [dose] and every [[structure]] of a scene file. Errors: UserError as TomlTable's.
void read_implant(TomlTable& top, Scene& scene);

}  // namespace brachy
