#pragma once

#include <cstddef>
#include <string>

namespace brachy {

struct TerminalSize {
  std::size_t columns = 80, rows = 24;
};

/// Whether lines may be redrawn on this file descriptor: it is a terminal, and TERM does not say that it is a dumb one.
bool is_drawable(int fd);

/// Its present size; 80 × 24 where that is not known.
TerminalSize size_of_terminal(int fd);

/// Whether colour is wanted: NO_COLOR (no-color.org) is unset or empty.
bool wants_colour();

/// Columns that a text takes; escape sequences (CSI … letter) take none, every other character one.
std::size_t columns_of(const std::string& text);

/// Its first `columns` columns; later escape sequences are kept, so that a colour that was begun ends.
std::string cut_to(const std::string& text, std::size_t columns);

/// The same, filled up with blanks.
std::string padded_to(const std::string& text, std::size_t columns);

}  // namespace brachy
