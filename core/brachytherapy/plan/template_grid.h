#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/rigid_transform.h"

namespace brachy {

/// The template's holes: columns along +x, which is to the patient's right, rows along +y; needles go through them
/// along +z (from the perineum to the base). mm, world frame W. The default lies 37.5 mm in front of the default
/// phantom's apex, its middle hole, G7, on the phantom's axis.
///
/// A hole has a letter and a number. As the first versions and the wire have it, A, B, … begin at the patient's left
/// and 1, 2, … below. Clinical templates begin with A at the patient's right, which is the left of who looks at it;
/// many have, between each two lettered columns and numbered rows, one more: A, a, B, b, … and 1, 1.5, 2, 2.5, ….
struct TemplateGrid {
  static constexpr int kMaxColumns = 26, kMaxRows = 99;

  int columns = 13, rows = 13;  ///< 1 … kMaxColumns, 1 … kMaxRows
  double spacing_mm = 5;
  Vec3 origin_mm{-30, -30, -60};      ///< the hole of the least x and y
  std::string letters_from = "left";  ///< "left" or "right" of the patient: where A is
  bool half_steps = false;            ///< every other column has a lower-case letter, every other row a half

  /// Position of "D4", with half steps also "d4.5", mm; nothing for a hole that does not exist.
  std::optional<Vec3> position(std::string_view hole) const;
  Vec3 position(int column, int row) const;     ///< from 0, mm; also beside the grid
  std::string name(int column, int row) const;  ///< from 0, of a hole that exists
  /// The hole that the line through p along `axis` passes within half a spacing of (in x and in y); nothing beside
  /// the grid.
  std::optional<std::string> nearest(const Vec3& p, const Vec3& axis) const;
  /// For messages about a hole that does not exist: "the template has A1 … M13", and of a half step where there are
  /// none what to do.
  std::string lacks(std::string_view hole) const;

  /// The same holes by other names.
  TemplateGrid named(std::string_view from, bool with_half_steps) const;
  /// As the wire names them.
  TemplateGrid named_as_on_wire() const { return named("left", false); }
  /// The name of the hole that `other`, the same holes by other names, calls `hole`; `hole` itself where there is none.
  std::string renamed(const std::string& hole, const TemplateGrid& other) const;
  bool is_named_as(const TemplateGrid& other) const {
    return letters_from == other.letters_from && half_steps == other.half_steps;
  }

  bool operator==(const TemplateGrid&) const = default;

 private:
  struct Hole {
    int column = 0, row = 0;
  };
  std::optional<Hole> find(std::string_view hole) const;
};

}  // namespace brachy
