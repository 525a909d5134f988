#pragma once

#include <array>
#include <cstdint>

namespace brachy {

// Numbering within a cell: corner c lies at (c & 1, c >> 1 & 1, c >> 2); edge 4a + m goes along axis a from its corner
// with the two other coordinates (m & 1, m >> 1), in the order of axes (a + 1) % 3, (a + 2) % 3.

/// The two corners of an edge, the lower one first.
constexpr std::array<int, 2> corners_of_edge(int edge) {
  const int a = edge / 4, m = edge % 4;
  const int low = (m & 1) << (a + 1) % 3 | (m >> 1) << (a + 2) % 3;
  return {low, low | 1 << a};
}

/// How the surface passes through a cell whose inside corners are the bits of a configuration.
struct CellSheets {
  std::array<std::int8_t, 12>
      of_edge{};  ///< the sheet that an edge belongs to; −1: the surface does not cross it
  int count = 0;  ///< sheets, 0 … 4
  /// on a face of the cell, both pairs of crossings belong to the same sheet
  bool may_share_an_edge = false;
};

/// Of each of the 256 configurations; computed at the first call.
const std::array<CellSheets, 256>& cell_sheets();

}  // namespace brachy
