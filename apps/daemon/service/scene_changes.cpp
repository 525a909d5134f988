#include "apps/daemon/service/scene_changes.h"

#include "core/scene/file/scene_keys.h"

namespace brachy {
namespace {

void compare(const Key<Scene>& key, const std::string& name, const Scene& read, SceneChanges& changes) {
  if (key.reload == Reload::kIgnored || key.is_same(changes.scene, read)) return;
  if (key.reload == Reload::kRestart) {
    changes.kept.push_back(name);
    return;
  }
  changes.taken.push_back(name);
  key.copy(changes.scene, read);
}

}  // namespace

SceneChanges changes_of(const Scene& in_use, const Scene& read) {
  SceneChanges changes{in_use, {}, {}};
  for (const SceneSection& section : scene_sections()) {
    const std::string prefix = section.is_top() ? "" : std::string(section.name) + ".";
    if (section.list)
      compare(section.list->whole, section.name, read, changes);
    else
      for (const Key<Scene>& key : section.keys) compare(key, prefix + key.name, read, changes);
  }
  return changes;
}

}  // namespace brachy
