#include "core/scene/file/scene_keys.h"

#include <iterator>

#include "core/base/colour_text.h"

namespace brachy {

const std::vector<SceneSection>& scene_sections() {
  static const std::vector<SceneSection> sections = [] {
    std::vector<SceneSection> all = {
        {"", "", {text("name", &Scene::name, {}, Reload::kRestart, "shown by the viewer and the log")}}};
    for (std::vector<SceneSection> part :
         {tissue_sections(), needle_sections(), implant_sections(), service_sections()})
      std::move(part.begin(), part.end(), std::back_inserter(all));
    return all;
  }();
  return sections;
}

void check_colour(const TomlTable& table, const std::string& colour) {
  if (!colour.empty() && !colour_from(colour))
    table.contradiction("colour", "is \"" + colour + "\"; write it as #rrggbb, such as \"#f2c94c\"");
}

}  // namespace brachy
