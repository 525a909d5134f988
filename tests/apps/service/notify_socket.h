#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/apps/apps_testing.h"

namespace brachy::test {

/// The socket to which a service sends its state, as systemd's.
class NotifySocket {
 public:
  explicit NotifySocket(const std::filesystem::path& path)
      : path_(path.string()), socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path_.size() >= sizeof address.sun_path) throw std::runtime_error("too long for a socket: " + path_);
    path_.copy(address.sun_path, path_.size());
    if (::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error(path_ + ": " + std::strerror(errno));
  }

  /// "NOTIFY_SOCKET=…", for env(1).
  std::string variable() const { return "NOTIFY_SOCKET=" + path_; }

  /// Reads messages until one contains this line; false where none comes.
  bool hears(const std::string& line) {
    const Deadline deadline;
    while (take(deadline.left_ms())) {
      for (const std::string& said : lines_of(messages.back()))
        if (said == line || (line.back() == '=' && said.starts_with(line))) return true;
    }
    return false;
  }

  /// Reads pending messages; returns how many of them contain this line.
  int count_new(const std::string& line) {
    int count = 0;
    while (take(0))
      for (const std::string& said : lines_of(messages.back())) count += said == line;
    return count;
  }

  std::vector<std::string> messages;

 private:
  bool take(int timeout_ms) {
    pollfd ready{socket_.get(), POLLIN, 0};
    if (::poll(&ready, 1, timeout_ms) <= 0) return false;
    std::array<char, 4096> message;
    const ssize_t size = ::recv(socket_.get(), message.data(), message.size(), 0);
    if (size < 0) return false;
    messages.emplace_back(message.data(), static_cast<std::size_t>(size));
    return true;
  }

  std::string path_;
  FileDescriptor socket_;
};

}  // namespace brachy::test
