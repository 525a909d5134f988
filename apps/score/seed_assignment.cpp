#include "apps/score/seed_assignment.h"

#include <limits>

namespace brachy {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

// Costs are reduced by potentials of rows and columns, so that none is negative and those of assigned pairs are 0; then
// each new row's shortest path to a free column, or to a row that gives its own up, keeps the assignment cheapest. A
// row may also take no column, which is a column of its own that costs `unassigned`.
class Assignment {
 public:
  Assignment(std::size_t rows, std::size_t columns, double unassigned,
             const std::function<double(std::size_t, std::size_t)>& cost)
      : unassigned_(unassigned),
        cost_(cost),
        row_potential_(rows, 0.0),
        column_potential_(columns, 0.0),
        row_of_(columns, kNone),
        column_of_(rows, kNone),
        distance_(columns),
        from_(columns),
        is_reached_(columns) {}

  void add(std::size_t row) {
    distance_.assign(distance_.size(), kFar);
    is_reached_.assign(is_reached_.size(), 0);
    std::size_t giving_up = kNone, end = kNone;  // the path ends at a row that gives up, or at a free column
    double to_giving_up = kFar, so_far = 0;
    for (std::size_t at = row;;) {
      if (const double none = so_far + unassigned_ - row_potential_[at]; none < to_giving_up) {
        to_giving_up = none;
        giving_up = at;
      }
      const std::size_t nearest = reach_from(at, so_far);
      if (nearest == kNone || to_giving_up < distance_[nearest]) {
        so_far = to_giving_up;
        break;
      }
      so_far = distance_[nearest];
      is_reached_[nearest] = 1;
      if (row_of_[nearest] == kNone) {
        end = nearest;
        break;
      }
      at = row_of_[nearest];
    }
    update_potentials(row, so_far);
    if (end == kNone) {
      end = column_of_[giving_up];
      column_of_[giving_up] = kNone;
      if (giving_up == row) return;
    }
    swap_along(row, end);
  }

  std::size_t column_of(std::size_t row) const { return column_of_[row]; }

 private:
  // Shortens the ways to the columns by those over row `at`; the nearest column that is not reached yet.
  std::size_t reach_from(std::size_t at, double so_far) {
    std::size_t nearest = kNone;
    for (std::size_t j = 0; j < distance_.size(); ++j) {
      if (is_reached_[j]) continue;
      const double way = so_far + cost_(at, j) - row_potential_[at] - column_potential_[j];
      if (way < distance_[j]) {
        distance_[j] = way;
        from_[j] = at;
      }
      if (nearest == kNone || distance_[j] < distance_[nearest]) nearest = j;
    }
    return nearest;
  }

  void update_potentials(std::size_t row, double length) {
    row_potential_[row] += length;
    for (std::size_t j = 0; j < distance_.size(); ++j) {
      if (!is_reached_[j]) continue;
      column_potential_[j] += distance_[j] - length;
      if (row_of_[j] != kNone) row_potential_[row_of_[j]] += length - distance_[j];
    }
  }

  // Every row of the path takes the column that the path leaves it for.
  void swap_along(std::size_t row, std::size_t column) {
    for (;;) {
      const std::size_t taker = from_[column], freed = column_of_[taker];
      column_of_[taker] = column;
      row_of_[column] = taker;
      if (taker == row) return;
      column = freed;
    }
  }

  double unassigned_;
  const std::function<double(std::size_t, std::size_t)>& cost_;
  std::vector<double> row_potential_, column_potential_;
  std::vector<std::size_t> row_of_, column_of_;
  // Of the row being added: each column's distance from it, and the row before it on the way.
  std::vector<double> distance_;
  std::vector<std::size_t> from_;
  std::vector<char> is_reached_;
};

}  // namespace

std::vector<std::optional<std::size_t>> cheapest_assignment(
    std::size_t rows, std::size_t columns, double unassigned,
    const std::function<double(std::size_t row, std::size_t column)>& cost) {
  Assignment assignment(rows, columns, unassigned, cost);
  for (std::size_t row = 0; row < rows; ++row) assignment.add(row);
  std::vector<std::optional<std::size_t>> columns_of(rows);
  for (std::size_t row = 0; row < rows; ++row)
    if (assignment.column_of(row) != kNone) columns_of[row] = assignment.column_of(row);
  return columns_of;
}

}  // namespace brachy
