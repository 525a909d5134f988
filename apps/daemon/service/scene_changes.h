#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace brachy {

/// The differences between the scene in use and one that was read again. Keys are named as in the file: "model.kernel".
struct SceneChanges {
  Scene scene;                     ///< the one in use, with the new values of `taken`
  std::vector<std::string> taken;  ///< keys that can change while the daemon runs
  std::vector<std::string> kept;   ///< other keys that differ: they need a restart
};

/// A simulator of the same tissue and needles can be replaced while clients stay connected: its model, mechanics and
/// engine. Points and needles, which clients are sent when they connect, files, ports and rates cannot change.
/// core/scene/file/scene_keys.h has this property of each key.
SceneChanges changes_of(const Scene& in_use, const Scene& read);

}  // namespace brachy
