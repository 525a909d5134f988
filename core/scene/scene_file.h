#pragma once

#include <filesystem>
#include <string_view>

#include "core/scene/scene.h"

namespace brachy {

/// Reads a scene from a TOML file. Every key has a default (scene.h) and a checked range.
/// Throws UserError naming file, line and fix: unreadable, not TOML, an unknown key (with the nearest valid name),
/// a wrong type, a value out of range, settings that contradict each other. Mesh and trajectory files are not
/// opened here.
Scene load_scene(const std::filesystem::path& file);

/// The same from text; `name` stands for the file in messages.
Scene parse_scene(std::string_view text, const std::string& name);

}  // namespace brachy
