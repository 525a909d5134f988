#include "apps/terminal/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace brachy {
namespace {

/// Calls visit(piece, columns) for each character and each escape sequence of a UTF-8 text.
template <class Visit>
void for_each_piece(const std::string& text, Visit&& visit) {
  for (std::size_t i = 0; i < text.size();) {
    std::size_t end = i + 1, columns = 1;
    if (text.compare(i, 2, "\x1b[") == 0) {
      end = i + 2;
      while (end < text.size() && (text[end] < '@' || text[end] > '~')) ++end;
      end = end < text.size() ? end + 1 : end;
      columns = 0;
    } else {
      while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) ++end;
    }
    visit(std::string_view(text).substr(i, end - i), columns);
    i = end;
  }
}

}  // namespace

bool is_drawable(int fd) {
  if (::isatty(fd) != 1) return false;
  const char* term = std::getenv("TERM");
  return term != nullptr && *term != '\0' && std::string_view(term) != "dumb";
}

TerminalSize size_of_terminal(int fd) {
  winsize size{};
  if (::ioctl(fd, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) return {};
  return {size.ws_col, size.ws_row};
}

bool wants_colour() {
  const char* no_colour = std::getenv("NO_COLOR");
  return no_colour == nullptr || *no_colour == '\0';
}

std::size_t columns_of(const std::string& text) {
  std::size_t count = 0;
  for_each_piece(text, [&](std::string_view, std::size_t columns) { count += columns; });
  return count;
}

std::string cut_to(const std::string& text, std::size_t columns) {
  std::string result;
  std::size_t count = 0;
  for_each_piece(text, [&](std::string_view piece, std::size_t own) {
    count += own;
    if (own == 0 || count <= columns) result += piece;
  });
  return result;
}

std::string padded_to(const std::string& text, std::size_t columns) {
  std::string result = cut_to(text, columns);
  result.append(columns - columns_of(result), ' ');
  return result;
}

}  // namespace brachy
