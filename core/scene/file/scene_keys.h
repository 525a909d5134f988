#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "core/scene/file/key.h"
#include "core/scene/scene.h"

namespace brachy {

/// One [section] of a scene file, or a [[section]], which may stand there several times. Its default values are those
/// of `Scene`.
struct SceneSection {
  const char* name;              ///< empty: the top of the file
  const char* comment;           ///< stands above it in config/prostate.toml
  std::vector<Key<Scene>> keys;  ///< in the order of the file; of a [[section]]: of its last entry
  /// Refuses values that contradict each other, and sets defaults that depend on other keys; it runs when `keys` have
  /// been read, and may use the sections before this one. Errors: UserError as TomlTable's.
  void (*check)(const TomlTable& table, Scene& scene) = nullptr;

  bool is_top() const { return *name == 0; }

  /// Of a [[section]] only.
  struct List {
    Key<Scene> whole;                                      ///< all its entries as one key, for a reload
    void (*append)(const TomlTable& table, Scene& scene);  ///< an entry with its default values
    void (*append_example)(Scene& scene);                  ///< the one that config/prostate.toml shows
  };
  std::optional<List> list = {};
};

/// Every key that a scene file may have, in the order of config/prostate.toml. The parser, the comparison at a reload,
/// config/prostate.toml and config/KEYS.md are made from this list.
/// Threads: any.
const std::vector<SceneSection>& scene_sections();

/// All entries of a [[section]] as one key. Their places in the file do not count as a difference.
template <class Entry>
Key<Scene> list_key(const char* name, std::vector<Entry> Scene::*list, Reload reload) {
  Key<Scene> key;
  key.name = name;
  key.reload = reload;
  key.is_same = [list](const Scene& a, const Scene& b) {
    return std::ranges::equal(a.*list, b.*list, [](Entry x, const Entry& y) {
      x.place = y.place;
      return x == y;
    });
  };
  key.copy = [list](Scene& to, const Scene& from) { to.*list = from.*list; };
  return key;
}

/// Refuses a `colour` that is neither empty nor "#rrggbb".
void check_colour(const TomlTable& table, const std::string& colour);

// Its parts.
std::vector<SceneSection> tissue_sections();
std::vector<SceneSection> needle_sections();
std::vector<SceneSection> implant_sections();
SceneSection ultrasound_section();
std::vector<SceneSection> service_sections();

}  // namespace brachy
