#include "apps/daemon/service/non_blocking_stderr.h"

#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <string>

namespace brachy {
namespace {

constexpr int kWaitMs = 5;  // for a slow reader; no wait while lines are being dropped

bool is_pipe_or_socket(int descriptor) {
  struct stat about {};
  return ::fstat(descriptor, &about) == 0 && (S_ISFIFO(about.st_mode) || S_ISSOCK(about.st_mode));
}

}  // namespace

NonBlockingStderr::NonBlockingStderr(int descriptor)
    : descriptor_(descriptor), may_block_(is_pipe_or_socket(descriptor)) {}

std::streamsize NonBlockingStderr::xsputn(const char* text, std::streamsize size) {
  if (left_out_ > 0 && is_writable()) {
    const std::string note = std::to_string(left_out_) + " lines of the log dropped: its reader stalled\n";
    if (write(note)) left_out_ = 0;
  }
  if (!write({text, static_cast<std::size_t>(size)})) ++left_out_;
  return size;  // an ostream would treat less as a failure, and stay failed
}

NonBlockingStderr::int_type NonBlockingStderr::overflow(int_type character) {
  const char c = traits_type::to_char_type(character);
  xsputn(&c, 1);
  return traits_type::not_eof(character);
}

// A pipe or a socket that is writable accepts PIPE_BUF bytes without blocking.
bool NonBlockingStderr::write(std::string_view text) {
  while (!text.empty()) {
    if (!is_writable()) return false;
    const ssize_t written = ::write(descriptor_, text.data(), std::min<std::size_t>(text.size(), PIPE_BUF));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool NonBlockingStderr::is_writable() {
  pollfd ready{descriptor_, POLLOUT, 0};
  return ::poll(&ready, 1, left_out_ > 0 ? 0 : kWaitMs) > 0;
}

}  // namespace brachy
