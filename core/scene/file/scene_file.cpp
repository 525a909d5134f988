#include "core/scene/file/scene_file.h"

#include <fstream>
#include <sstream>

#include "core/base/denied_folder.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/toml_table.h"
#include "core/scene/choose_source.h"
#include "core/scene/file/scene_keys.h"
#include "core/scene/structure_roles.h"

namespace brachy {
namespace {

constexpr std::uintmax_t kMaxSceneBytes = 1 << 20;

void read_table(TomlTable table, const SceneSection& section, Scene& scene) {
  for (const Key<Scene>& key : section.keys) key.read(table, scene);
  table.refuse_unknown();
  if (section.check) section.check(table, scene);
}

void read_section(TomlTable& top, const SceneSection& section, Scene& scene) {
  if (!section.list) return read_table(top.table(section.name), section, scene);
  for (const TomlTable& table : top.tables(section.name)) {
    section.list->append(table, scene);
    read_table(table, section, scene);
  }
}

/// Goals name structures as the scene does, or by their roles: afterwards as dose reports do.
void call_by_roles(Scene& scene) {
  const std::vector<std::string> names = structure_names(scene);
  for (DoseGoal& goal : scene.goals)
    for (std::size_t n = 0; n < names.size(); ++n)
      if (goal.structure == scene.structures[n].name) {
        goal.structure = names[n];
        break;
      }
}

/// "table.key" of each key below the top.
std::vector<std::string> keys_of_tables() {
  std::vector<std::string> names;
  for (const SceneSection& section : scene_sections())
    if (!section.is_top() && !section.list)
      for (const Key<Scene>& key : section.keys) names.push_back(std::string(section.name) + "." + key.name);
  return names;
}

}  // namespace

Scene parse_scene(std::string_view text, const std::string& name) {
  Scene scene;
  TomlTable top = parse_toml(text, name);
  for (const SceneSection& section : scene_sections())
    if (section.is_top())
      for (const Key<Scene>& key : section.keys) key.read(top, scene);
    else
      read_section(top, section, scene);
  top.refuse_unknown(keys_of_tables());
  call_by_roles(scene);
  return scene;
}

Scene load_scene(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code error;
  refuse_denied_folder(file);
  if (std::filesystem::is_directory(file, error))
    throw UserError(name + ": is a folder; name the scene file in it, such as " +
                    (file / "prostate.toml").lexically_normal().string());
  if (!std::filesystem::is_regular_file(file, error))
    throw UserError(
        name + ": no such scene file; give one with --config (config/prostate.toml is the default scene)");
  if (std::filesystem::file_size(file, error) > kMaxSceneBytes)
    throw UserError(name + ": larger than 1 MiB; a scene file is a page of TOML");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw UserError(name + ": cannot be read; check its permissions");
  Scene scene = reading(file, FileKind::kScene, [&] { return parse_scene(text.str(), name); });
  scene.directory = file.parent_path();
  choose_source(scene);
  return scene;
}

}  // namespace brachy
