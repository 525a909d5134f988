#include "apps/daemon/service/non_blocking_stderr.h"

#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>

namespace brachy {
namespace {

constexpr int kWaitMs = 5;  // for a slow reader; no wait while lines are waiting or being dropped

bool is_pipe_or_socket(int descriptor) {
  struct stat about {};
  return ::fstat(descriptor, &about) == 0 && (S_ISFIFO(about.st_mode) || S_ISSOCK(about.st_mode));
}

}  // namespace

NonBlockingStderr::NonBlockingStderr(int descriptor)
    : descriptor_(descriptor), may_block_(is_pipe_or_socket(descriptor)) {}

void NonBlockingStderr::write_safety(std::string_view line) {
  if (has_written_waiting() && has_written(line)) return;
  if (waiting_.size() < kMostWaiting)
    waiting_.emplace_back(line);
  else
    ++dropped_of_safety_;
}

std::streamsize NonBlockingStderr::xsputn(const char* text, std::streamsize size) {
  std::string_view rest(text, static_cast<std::size_t>(size));
  if (!has_written_waiting() || !has_written(rest)) ++dropped_;
  return size;  // an ostream would treat less as a failure, and stay failed
}

NonBlockingStderr::int_type NonBlockingStderr::overflow(int_type character) {
  const char c = traits_type::to_char_type(character);
  xsputn(&c, 1);
  return traits_type::not_eof(character);
}

bool NonBlockingStderr::has_written_waiting() {
  for (; !waiting_.empty(); waiting_.pop_front()) {
    std::string_view rest = waiting_.front();
    if (has_written(rest)) continue;
    waiting_.front() = std::string(rest);
    return false;
  }
  if (dropped_ == 0 && dropped_of_safety_ == 0) return true;
  const std::string note = dropped_of_safety_ == 0
                               ? std::to_string(dropped_) + " lines of the log dropped: its reader stalled\n"
                               : std::to_string(dropped_ + dropped_of_safety_) +
                                     " lines of the log dropped, " + std::to_string(dropped_of_safety_) +
                                     " about safety: its reader stalled\n";
  std::string_view rest = note;
  if (!has_written(rest)) return false;
  dropped_ = dropped_of_safety_ = 0;
  return true;
}

// A pipe or a socket that is writable accepts PIPE_BUF bytes without blocking. `text` is left with what did not fit.
bool NonBlockingStderr::has_written(std::string_view& text) {
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
  const bool is_behind = !waiting_.empty() || dropped_ > 0 || dropped_of_safety_ > 0;
  pollfd ready{descriptor_, POLLOUT, 0};
  return ::poll(&ready, 1, is_behind ? 0 : kWaitMs) > 0;
}

}  // namespace brachy
