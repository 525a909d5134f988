#include "apps/terminal/screen.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace brachy {

TerminalScreen::TerminalScreen(int fd) : fd_(fd) {
  write("\x1b[?1049h\x1b[?25l\x1b[2J");
}

TerminalScreen::~TerminalScreen() {
  write("\x1b[?25h\x1b[?1049l");
}

void TerminalScreen::draw(const std::vector<std::string>& lines) {
  const TerminalSize now = size();
  std::string text = "\x1b[H";
  for (std::size_t i = 0; i < std::min(lines.size(), now.rows); ++i)
    text += (i ? "\r\n" : "") + cut_to(lines[i], now.columns) + "\x1b[K";
  write(text + "\x1b[J");
}

// Errors are ignored: the terminal has gone.
void TerminalScreen::write(const std::string& text) const {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = ::write(fd_, text.data() + done, text.size() - done);
    if (count < 0 && errno != EINTR) return;
    if (count > 0) done += static_cast<std::size_t>(count);
  }
}

}  // namespace brachy
