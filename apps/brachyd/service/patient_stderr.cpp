#include "apps/brachyd/service/patient_stderr.h"

#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <string>

namespace brachy {
namespace {

constexpr int kPatienceMs = 5;  // for a reader that is only slow; not again until it has read

bool is_pipe_or_socket(int descriptor) {
  struct stat about {};
  return ::fstat(descriptor, &about) == 0 && (S_ISFIFO(about.st_mode) || S_ISSOCK(about.st_mode));
}

}  // namespace

PatientStderr::PatientStderr(int descriptor)
    : descriptor_(descriptor), may_block_(is_pipe_or_socket(descriptor)) {}

std::streamsize PatientStderr::xsputn(const char* text, std::streamsize size) {
  if (left_out_ > 0 && has_room()) {
    const std::string told = std::to_string(left_out_) + " lines of the log left out: nobody read them\n";
    if (write(told)) left_out_ = 0;
  }
  if (!write({text, static_cast<std::size_t>(size)})) ++left_out_;
  return size;  // an ostream would take less for a failure, and stay failed
}

PatientStderr::int_type PatientStderr::overflow(int_type character) {
  const char c = traits_type::to_char_type(character);
  xsputn(&c, 1);
  return traits_type::not_eof(character);
}

// A pipe that is ready takes PIPE_BUF bytes without waiting, and so does a socket.
bool PatientStderr::write(std::string_view text) {
  while (!text.empty()) {
    if (!has_room()) return false;
    const ssize_t written = ::write(descriptor_, text.data(), std::min<std::size_t>(text.size(), PIPE_BUF));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool PatientStderr::has_room() {
  pollfd ready{descriptor_, POLLOUT, 0};
  return ::poll(&ready, 1, left_out_ > 0 ? 0 : kPatienceMs) > 0;
}

}  // namespace brachy
