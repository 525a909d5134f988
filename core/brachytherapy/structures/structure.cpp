#include "core/brachytherapy/structures/structure.h"

#include <algorithm>

namespace brachy {

const Structure* find_structure(const std::vector<Structure>& structures, std::string_view name) {
  const auto found = std::ranges::find(structures, name, &Structure::name);
  return found == structures.end() ? nullptr : &*found;
}

}  // namespace brachy
