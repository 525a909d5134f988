#include "core/scene/load_needle_tissues.h"

#include "core/scene/load_body.h"

namespace brachy {

NeedleTissues load_needle_tissues(const Scene& scene) {
  std::vector<NeedleTissues::Part> parts;
  for (const RegionSettings& region : scene.regions)
    if (region.contact) parts.push_back({load_region(scene, region), *region.contact});
  return {scene.tissue.contact, std::move(parts), scene.needle.diameter_mm};
}

}  // namespace brachy
