#include "core/brachytherapy/plan/template_grid.h"

#include <charconv>
#include <cmath>

namespace brachy {

std::optional<Vec3> TemplateGrid::position(std::string_view hole) const {
  if (hole.size() < 2) return {};
  const char letter = hole[0];
  const int column = letter >= 'a' ? letter - 'a' : letter - 'A';
  int row = 0;
  const char* end = hole.data() + hole.size();
  const auto read = std::from_chars(hole.data() + 1, end, row);
  // "D04" is not accepted: each hole has one name.
  if (read.ec != std::errc() || read.ptr != end || hole[1] == '0') return {};
  if (column < 0 || column >= columns || row < 1 || row > rows) return {};
  return position(column, row - 1);
}

Vec3 TemplateGrid::position(int column, int row) const {
  return origin_mm + spacing_mm * Vec3(column, row, 0);
}

std::string TemplateGrid::name(int column, int row) const {
  return static_cast<char>('A' + column) + std::to_string(row + 1);
}

std::optional<std::string> TemplateGrid::nearest(const Vec3& p, const Vec3& axis) const {
  const Vec3 met = p + (origin_mm.z() - p.z()) / axis.z() * axis;
  const double column = std::round((met.x() - origin_mm.x()) / spacing_mm);
  const double row = std::round((met.y() - origin_mm.y()) / spacing_mm);
  // Also false for NaN, which a line parallel to the template gives.
  if (!(column >= 0 && column < columns && row >= 0 && row < rows)) return {};
  return name(static_cast<int>(column), static_cast<int>(row));
}

std::string TemplateGrid::extent() const {
  return name(0, 0) + " … " + name(columns - 1, rows - 1);
}

}  // namespace brachy
