#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace brachy {

/// A number in space for the inner loops: trilinear between the nodes of a grid, `outside` beyond it; null: everywhere.
struct GridView {
  const float* values = nullptr;
  std::array<float, 3> least{};  ///< mm
  float per_mm = 1;              ///< nodes
  std::array<std::int32_t, 3> counts{};
  float outside = 0;
};

/// What a phantom's or a patient's body is made of, as numbers for the inner loops; mm, at rest.
struct Anatomy {
  struct Ellipsoid {
    std::array<float, 3> centre{}, semi_axes{};
  };
  struct Spot {
    std::array<float, 3> centre{};
    float radius = 1;
  };
  GridView gland, urethra, bladder;       ///< signed distances, negative inside
  bool has_surroundings = false;          ///< what follows is there
  std::array<float, 3> middle{}, half{};  ///< of the gland's box
  Ellipsoid transition_zone;
  Ellipsoid full_bladder;  ///< where `bladder` is none
  std::array<float, 3> ramus_top{},
      ramus_way{};  ///< of one side, from `middle`; the other is its mirror image
  float ramus_radius = 1;
  std::span<const Spot> calcifications;
  std::uint32_t seed = 0;
};

}  // namespace brachy
