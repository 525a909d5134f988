#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/rigid_transform.h"

namespace brachy {

/// The template's holes: columns A, B, … along +x, rows 1, 2, … along +y; needles go through them along +z (from the
/// perineum to the base). mm, world frame W. The default lies 37.5 mm in front of the default phantom's apex, its
/// middle hole, G7, on the phantom's axis.
struct TemplateGrid {
  static constexpr int kMaxColumns = 26, kMaxRows = 99;

  int columns = 13, rows = 13;  ///< 1 … kMaxColumns, 1 … kMaxRows
  double spacing_mm = 5;
  Vec3 origin_mm{-30, -30, -60};  ///< hole A1

  /// Position of "D4" (also "d4"), mm; nothing for a hole that does not exist.
  std::optional<Vec3> position(std::string_view hole) const;
  Vec3 position(int column, int row) const;     ///< from 0, mm; also beside the grid
  std::string name(int column, int row) const;  ///< from 0, of a hole that exists
  /// The hole that the line through p along `axis` passes within half a spacing of (in x and in y); nothing beside
  /// the grid.
  std::optional<std::string> nearest(const Vec3& p, const Vec3& axis) const;
  std::string extent() const;  ///< "A1 … M13", for messages

  bool operator==(const TemplateGrid&) const = default;
};

}  // namespace brachy
