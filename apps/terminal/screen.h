#pragma once

#include <string>
#include <vector>

#include "apps/terminal/terminal.h"

namespace brachy {

/// A terminal's second screen while it lives: lines that are redrawn in place, without a cursor. The destructor
/// restores the terminal.
class TerminalScreen {
 public:
  /// `fd` is_drawable().
  explicit TerminalScreen(int fd);
  ~TerminalScreen();
  TerminalScreen(const TerminalScreen&) = delete;
  TerminalScreen& operator=(const TerminalScreen&) = delete;

  TerminalSize size() const { return size_of_terminal(fd_); }

  /// Shows the lines from the top, as many and as much of each as fit.
  void draw(const std::vector<std::string>& lines);

 private:
  void write(const std::string& text) const;
  const int fd_;
};

}  // namespace brachy
