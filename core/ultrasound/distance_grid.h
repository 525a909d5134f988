#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/surface/surface_bvh.h"
#include "core/ultrasound/anatomy.h"

namespace brachy {

/// The signed distance of a closed surface on a grid about it, negative inside, mm; between nodes trilinear (off by
/// spacing² × curvature / 8), beyond the grid its margin or more.
/// Threads: const functions from any. Real-time: they do not allocate.
class DistanceGrid {
 public:
  /// Nothing: everywhere far outside.
  DistanceGrid() = default;
  /// Takes some microseconds a node.
  DistanceGrid(const SurfaceBvh& surface, double spacing_mm, double margin_mm);

  /// What reads it; valid as long as this is.
  GridView view() const noexcept;
  bool is_empty() const { return values_.empty(); }

 private:
  Vec3 least_ = Vec3::Zero();
  double spacing_ = 1;
  float outside_ = 1e3F;
  std::size_t counts_[3] = {0, 0, 0};
  std::vector<float> values_;
};

}  // namespace brachy
