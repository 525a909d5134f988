#pragma once

#include <cstddef>
#include <deque>
#include <string>

namespace brachy {

/// `share` (0 … 1; NaN: nothing) of `columns` columns, in eighths of one, filled up with blanks.
std::string bar(double share, std::size_t columns);

/// `share` (−1 … 1) from the middle to the left or the right, about a line; `columns` is odd and at least 3.
std::string centred_bar(double share, std::size_t columns);

/// History of a value, a column per quarter of a second: of several values within one the farthest from 0.
class ValueHistory {
 public:
  static constexpr double kColumnS = 0.25;
  static constexpr std::size_t kLongest = 200;  // columns

  /// Times increase; one that goes back clears the history. `is_marked`: an event to mark. A value that is not finite
  /// is a gap.
  void add(double t_s, double value, bool is_marked = false);

  /// The last `columns` of it in eight heights from `low` to `high`, right-aligned; ▼ at marks.
  std::string sparkline(std::size_t columns, double low, double high) const;

  double smallest() const;  ///< NaN: there is none
  double largest() const;

 private:
  struct Column {
    double value;
    bool is_marked;
  };
  std::deque<Column> columns_;
  double last_s_ = 0;  // start of the last column
};

}  // namespace brachy
