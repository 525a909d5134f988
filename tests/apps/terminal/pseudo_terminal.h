#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <stdexcept>
#include <string>

#include "tests/apps/child_process.h"

namespace brachy::test {

/// A pseudo-terminal: output that a program writes to `end()` can be read here.
class PseudoTerminal {
 public:
  PseudoTerminal(unsigned short columns, unsigned short rows) {
    int master = -1, slave = -1;
    winsize size{rows, columns, 0, 0};
    if (openpty(&master, &slave, nullptr, nullptr, &size) != 0) throw std::runtime_error("openpty failed");
    master_.reset(master);
    slave_.reset(slave);
    fcntl(master, F_SETFD, FD_CLOEXEC);
    fcntl(slave, F_SETFD, FD_CLOEXEC);
  }
  int end() const { return slave_.get(); }
  void resize(unsigned short columns, unsigned short rows) {
    winsize size{rows, columns, 0, 0};
    EXPECT_EQ(ioctl(master_.get(), TIOCSWINSZ, &size), 0);
  }

  /// All that was written so far; waits a little for more.
  const std::string& read() {
    pollfd fd{master_.get(), POLLIN, 0};
    while (poll(&fd, 1, 5) > 0 && (fd.revents & POLLIN)) {
      std::array<char, 65536> buffer;
      const ssize_t count = ::read(master_.get(), buffer.data(), buffer.size());
      if (count <= 0) break;
      text_.append(buffer.data(), static_cast<std::size_t>(count));
    }
    return text_;
  }

 private:
  FileDescriptor master_, slave_;
  std::string text_;
};

}  // namespace brachy::test
