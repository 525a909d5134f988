#pragma once

namespace brachy {

class TomlTable;
struct Scene;

/// Reads [template], [seeds], [plan], [dose] and every [[structure]] of a scene file. Errors: UserError as TomlTable's.
void read_implant(TomlTable& top, Scene& scene);

}  // namespace brachy
