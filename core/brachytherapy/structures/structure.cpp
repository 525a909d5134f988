#include "core/brachytherapy/structures/structure.h"

#include <algorithm>

namespace brachy {

const Structure* find_structure(const std::vector<Structure>& structures, std::string_view name) {
  auto found = std::ranges::find(structures, name, &Structure::name);
  if (found == structures.end() && !name.empty())
    found = std::ranges::find(structures, name, &Structure::label);
  return found == structures.end() ? nullptr : &*found;
}

}  // namespace brachy
