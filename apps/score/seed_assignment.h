#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace brachy {

/// The cheapest assignment of rows to columns, at most one to one: minimises the sum of cost(row, column) ≥ 0 over
/// the assigned rows and of `unassigned` over the others. The column of each row; nothing: none. A pair that costs
/// more than `unassigned` is never made.
/// Hungarian algorithm by shortest augmenting paths (Jonker and Volgenant, Computing 38, 1987, 325–340), one row
/// after the other; O(rows² · columns) at worst. Deterministic.
std::vector<std::optional<std::size_t>> cheapest_assignment(
    std::size_t rows, std::size_t columns, double unassigned,
    const std::function<double(std::size_t row, std::size_t column)>& cost);

}  // namespace brachy
