#include "core/geometry/label_map/cell_sheets.h"

#include <algorithm>

namespace brachy {
namespace {

constexpr bool is_inside(int configuration, int corner) {
  return (configuration >> corner & 1) != 0;
}

int edge_between(int corner, int other) {
  for (int e = 0; e < 12; ++e) {
    const auto [low, high] = corners_of_edge(e);
    if ((low == corner && high == other) || (low == other && high == corner)) return e;
  }
  return -1;
}

/// The corners of a face, in order around it.
std::array<int, 4> corners_of_face(int axis, int side) {
  const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
  return {base, base | u, base | u | v, base | v};
}

struct SheetUnion {
  std::array<int, 12> parent{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  int root(int e) const {
    while (parent[static_cast<std::size_t>(e)] != e) e = parent[static_cast<std::size_t>(e)];
    return e;
  }
  void unite(int a, int b) { parent[static_cast<std::size_t>(root(a))] = root(b); }
};

CellSheets sheets_of(int configuration) {
  SheetUnion sheets;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const auto corners = corners_of_face(axis, side);
      std::array<int, 4> edges{}, crossed{};  // edge n goes from corner n to the next one
      int count = 0;
      for (std::size_t n = 0; n < 4; ++n) {
        edges[n] = edge_between(corners[n], corners[(n + 1) % 4]);
        if (is_inside(configuration, corners[n]) != is_inside(configuration, corners[(n + 1) % 4]))
          crossed[static_cast<std::size_t>(count++)] = edges[n];
      }
      if (count == 2) sheets.unite(crossed[0], crossed[1]);
      if (count == 4)
        for (std::size_t n = 0; n < 4; ++n)
          if (is_inside(configuration, corners[n])) sheets.unite(edges[n], edges[(n + 3) % 4]);
    }
  CellSheets result;
  std::array<int, 12> number{};
  number.fill(-1);
  for (int e = 0; e < 12; ++e) {
    const auto [low, high] = corners_of_edge(e);
    const auto at = static_cast<std::size_t>(e);
    if (is_inside(configuration, low) == is_inside(configuration, high)) {
      result.of_edge[at] = -1;
      continue;
    }
    const auto root = static_cast<std::size_t>(sheets.root(e));
    if (number[root] < 0) number[root] = result.count++;
    result.of_edge[at] = static_cast<std::int8_t>(number[root]);
  }
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const auto corners = corners_of_face(axis, side);
      bool is_ambiguous = true, is_one = true;
      for (std::size_t n = 0; n < 4; ++n) {
        const auto e = static_cast<std::size_t>(edge_between(corners[n], corners[(n + 1) % 4]));
        const auto first = static_cast<std::size_t>(edge_between(corners[0], corners[1]));
        is_ambiguous = is_ambiguous && result.of_edge[e] >= 0;
        is_one = is_one && result.of_edge[e] == result.of_edge[first];
      }
      result.may_share_an_edge = result.may_share_an_edge || (is_ambiguous && is_one);
    }
  return result;
}

}  // namespace

const std::array<CellSheets, 256>& cell_sheets() {
  static const std::array<CellSheets, 256> table = [] {
    std::array<CellSheets, 256> all;
    for (int c = 0; c < 256; ++c) all[static_cast<std::size_t>(c)] = sheets_of(c);
    return all;
  }();
  return table;
}

}  // namespace brachy
