#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/math/rigid_transform.h"

namespace brachy {

/// The template's holes: columns A, B, … along +x, rows 1, 2, … along +y; needles go through them along +z (from the
/// perineum to the base).
struct TemplateGrid {
  int columns = 13, rows = 13;  ///< 1 … 26, 1 … 99
  double spacing_mm = 5;
  Vec3 origin_mm{-30, -30, -60};  ///< hole A1

  std::optional<Vec3> position(
      std::string_view hole) const;             ///< "D4" (also "d4"), mm; nothing for one that is not there
  std::string name(int column, int row) const;  ///< from 0
  /// The hole that the line through p along `axis` passes within half a spacing of (in x and in y); nothing beside the grid.
  std::optional<std::string> nearest(const Vec3& p, const Vec3& axis) const;
  bool operator==(const TemplateGrid&) const = default;
};

}  // namespace brachy
