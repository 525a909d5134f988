#include "core/geometry/label_map/label_map.h"

#include <vector>

namespace brachy {

void add_segments_by_value(LabelMap& map) {
  for (std::size_t layer = 0; layer < map.layers.size(); ++layer) {
    std::vector<bool> occurs(65536, false);
    for (const std::uint16_t value : map.layers[layer]) occurs[value] = true;
    for (std::size_t value = 1; value < occurs.size(); ++value)
      if (occurs[value]) map.segments.push_back({"", static_cast<std::uint16_t>(value), layer, {}});
  }
}

}  // namespace brachy
