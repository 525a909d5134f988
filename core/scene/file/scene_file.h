#pragma once

#include <filesystem>
#include <string_view>

#include "core/scene/scene.h"

namespace brachy {

/// Reads a scene from a TOML file. Every key has a default (scene.h) and a checked range (scene_keys.h).
/// Throws UserError naming file, line and fix: unreadable, not TOML, an unknown key (with the nearest valid name),
/// a wrong type, a value out of range, settings that contradict each other. Does not open the mesh and trajectory files
/// that the scene names. Threads: any. Not real-time.
Scene load_scene(const std::filesystem::path& file);

/// Reads a scene from text; `name` stands for the file in errors.
Scene parse_scene(std::string_view text, const std::string& name);

}  // namespace brachy
