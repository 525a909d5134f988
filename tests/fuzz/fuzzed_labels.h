#pragma once

#include <algorithm>

#include "core/geometry/label_map/label_surface.h"
#include "tests/core/geometry/simplify/surface_distance.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {

/// Of the limit in use only the time is different: filling millions of voxels finds nothing.
inline constexpr std::size_t kMostFuzzedVoxels = std::size_t{1} << 15;

/// What must hold of every map that was read; small ones become surfaces, which must be closed.
inline void check_labels(const LabelMap& map) {
  EXPECT_FALSE(map.layers.empty());
  EXPECT_LE(map.grid.count() * map.layers.size(), kMostFuzzedVoxels);
  for (const auto& layer : map.layers) EXPECT_EQ(layer.size(), map.grid.count());
  for (const LabelMap::Segment& segment : map.segments) EXPECT_LT(segment.layer, map.layers.size());
  if (map.grid.count() > 512) return;
  for (std::size_t n = 0; n < map.segments.size() && n < 3; ++n) {
    const LabelMap::Segment& segment = map.segments[n];
    const auto& labels = map.layers[segment.layer];
    if (std::ranges::find(labels, segment.value) == labels.end()) continue;
    EXPECT_TRUE(test::is_closed_manifold(label_surface(map.grid, labels, segment.value).mesh));
  }
}

}  // namespace brachy::fuzz
