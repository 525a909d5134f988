#pragma once

#include <string>
#include <string_view>

namespace brachy {

/// The unit that a key's name ends in, as text: "puncture_force_n" is in N, "capsule_n_per_mm2" in N/mm². Empty where
/// it has none.
std::string unit_of_key(std::string_view name);

/// config/prostate.toml: the default scene, with every key and its comment.
std::string default_scene_toml();

/// config/KEYS.md: a table of the keys of each section.
std::string scene_keys_markdown();

}  // namespace brachy
