#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace brachy {

/// What a scene that was read again changes of the one in use. Keys are named as in the file: "model.kernel".
struct SceneChanges {
  Scene scene;                     ///< the one in use, with what can change while the daemon runs
  std::vector<std::string> taken;  ///< these keys
  std::vector<std::string> kept;   ///< others that differ: they take a restart
};

/// A simulator of the same tissue and the same needles can be made anew while clients stay: its model, mechanics and engine.
/// Points and needles, which clients were told of at their beginning, files, ports and rates cannot.
SceneChanges changes_of(const Scene& in_use, const Scene& read);

/// Every key that is looked at: all but auto's, whose choice shows in others.
std::vector<std::string> compared_keys();

}  // namespace brachy
