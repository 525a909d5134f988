#include "core/brachytherapy/plan/template_grid.h"

#include <charconv>
#include <cmath>

namespace brachy {

std::optional<TemplateGrid::Hole> TemplateGrid::find(std::string_view hole) const {
  if (hole.size() < 2) return {};
  const bool is_between = half_steps && hole[0] >= 'a';  // two lettered columns
  int column = hole[0] - (is_between ? 'a' : 'A');
  if (half_steps) column = 2 * column + is_between;
  std::string_view number = hole.substr(1);
  const bool is_half = half_steps && number.ends_with(".5");
  if (is_half) number.remove_suffix(2);
  int row = 0;
  const auto read = std::from_chars(number.data(), number.data() + number.size(), row);
  // "D04" is not accepted: each hole has one name.
  if (read.ec != std::errc() || read.ptr != number.data() + number.size() || number[0] == '0') return {};
  if (row < 1 || row > kMaxRows) return {};
  row = half_steps ? 2 * (row - 1) + is_half : row - 1;
  if (column < 0 || column >= columns || row >= rows) return {};
  return Hole{letters_from == "right" ? columns - 1 - column : column, row};
}

std::optional<Vec3> TemplateGrid::position(std::string_view hole) const {
  const auto found = find(hole);
  return found ? std::optional(position(found->column, found->row)) : std::nullopt;
}

Vec3 TemplateGrid::position(int column, int row) const {
  return origin_mm + spacing_mm * Vec3(column, row, 0);
}

std::string TemplateGrid::name(int column, int row) const {
  const int letter = letters_from == "right" ? columns - 1 - column : column;
  if (!half_steps) return static_cast<char>('A' + letter) + std::to_string(row + 1);
  const char first = letter % 2 == 0 ? 'A' : 'a';
  return static_cast<char>(first + letter / 2) + std::to_string(row / 2 + 1) + (row % 2 == 0 ? "" : ".5");
}

std::optional<std::string> TemplateGrid::nearest(const Vec3& p, const Vec3& axis) const {
  const Vec3 met = p + (origin_mm.z() - p.z()) / axis.z() * axis;
  const double column = std::round((met.x() - origin_mm.x()) / spacing_mm);
  const double row = std::round((met.y() - origin_mm.y()) / spacing_mm);
  // Also false for NaN, which a line parallel to the template gives.
  if (!(column >= 0 && column < columns && row >= 0 && row < rows)) return {};
  return name(static_cast<int>(column), static_cast<int>(row));
}

std::string TemplateGrid::lacks(std::string_view hole) const {
  const int first = letters_from == "right" ? columns - 1 : 0;
  const std::string extent =
      "the template has " + name(first, 0) + " … " + name(columns - 1 - first, rows - 1);
  const bool is_half_step = !half_steps && named(letters_from, true).find(hole);
  return extent + (is_half_step
                       ? "; lower case and .5 are half steps, for which half_steps = true has to be said"
                       : "");
}

TemplateGrid TemplateGrid::named(std::string_view from, bool with_half_steps) const {
  TemplateGrid other = *this;
  other.letters_from = from;
  other.half_steps = with_half_steps;
  return other;
}

std::string TemplateGrid::renamed(const std::string& hole, const TemplateGrid& other) const {
  const auto found = other.find(hole);
  return found ? name(found->column, found->row) : hole;
}

}  // namespace brachy
