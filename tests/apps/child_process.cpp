#include "tests/apps/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>

extern char** environ;

namespace brachy::test {
namespace {

void check(int error, const char* what) {
  if (error) throw std::runtime_error(std::string(what) + ": " + std::strerror(error));
}

struct Pipe {
  Pipe() {
    int ends[2];
    check(pipe2(ends, O_CLOEXEC) ? errno : 0, "pipe2");
    read.reset(ends[0]);
    write.reset(ends[1]);
  }
  FileDescriptor read, write;
};

struct FileActions {
  FileActions() { check(posix_spawn_file_actions_init(&actions), "file actions"); }
  ~FileActions() { posix_spawn_file_actions_destroy(&actions); }
  posix_spawn_file_actions_t actions;
};

// Appends the available output; closes `fd` at the end of the stream.
void read_into(FileDescriptor& fd, std::string& text) {
  std::array<char, 65536> buffer;
  const ssize_t count = read(fd.get(), buffer.data(), buffer.size());
  if (count > 0)
    text.append(buffer.data(), static_cast<std::size_t>(count));
  else if (count == 0 || (errno != EINTR && errno != EAGAIN))
    fd.reset();
}

}  // namespace

void FileDescriptor::reset(int fd) {
  if (fd_ >= 0) close(fd_);
  fd_ = fd;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find('\n', from), text.size());
    lines.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  return lines;
}

ChildProcess::ChildProcess(const std::vector<std::string>& argv, Output output) {
  Pipe out, err;
  FileActions files;
  check(posix_spawn_file_actions_addopen(&files.actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0), "stdin");
  const auto redirect = [&](int given, const Pipe& pipe, int to, const char* what) {
    check(posix_spawn_file_actions_adddup2(&files.actions, given >= 0 ? given : pipe.write.get(), to), what);
  };
  redirect(output.out, out, STDOUT_FILENO, "stdout");
  redirect(output.err, err, STDERR_FILENO, "stderr");

  std::vector<char*> arguments;
  for (const std::string& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  check(posix_spawn(&pid_, arguments[0], &files.actions, nullptr, arguments.data(), environ), arguments[0]);
  pidfd_.reset(static_cast<int>(syscall(SYS_pidfd_open, pid_, 0)));
  const int error = errno;
  out_.reset(out.read.release());
  err_.reset(err.read.release());
  if (!pidfd_.is_open()) {
    kill(pid_, SIGKILL);
    reap();
    check(error, "pidfd_open");
  }
}

ChildProcess::~ChildProcess() {
  if (reaped_) return;
  kill(pid_, SIGKILL);
  reap();
}

void ChildProcess::reap() {
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  reaped_ = true;
  if (WIFEXITED(status)) ended_.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) ended_.signal = WTERMSIG(status);
}

// Waits for output or the end of the process; false at the deadline, or when there is nothing left to wait for.
bool ChildProcess::poll_once(const Deadline& deadline) {
  if (deadline.has_passed()) return false;
  std::array<pollfd, 3> fds{{{out_.get(), POLLIN, 0}, {err_.get(), POLLIN, 0}, {-1, POLLIN, 0}}};
  // Once both streams have ended only the process remains; before that its end shows as theirs.
  if (!out_.is_open() && !err_.is_open()) {
    if (reaped_) return false;
    fds[2].fd = pidfd_.get();
  }
  const int ready = poll(fds.data(), fds.size(), deadline.left_ms());
  if (ready < 0) return errno == EINTR;
  if (fds[0].revents) read_into(out_, ended_.out);
  if (fds[1].revents) read_into(err_, ended_.err);
  if (fds[2].revents) reap();
  return true;
}

std::optional<std::string> ChildProcess::read_line() {
  const Deadline deadline;
  for (;;) {
    const std::size_t line_end = ended_.out.find('\n', lines_read_);
    if (line_end != std::string::npos) {
      std::string line = ended_.out.substr(lines_read_, line_end - lines_read_);
      lines_read_ = line_end + 1;
      return line;
    }
    if (!out_.is_open() || !poll_once(deadline)) return std::nullopt;
  }
}

bool ChildProcess::says(const std::string& text, std::size_t times) {
  const Deadline deadline;
  for (;;) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = ended_.err.find(text, at)) != std::string::npos; at += text.size())
      ++count;
    if (count >= times) return true;
    if (!err_.is_open() || !poll_once(deadline)) return false;
  }
}

void ChildProcess::send_signal(int number) {
  if (!reaped_) kill(pid_, number);
}

Ended ChildProcess::wait() {
  const Deadline deadline;
  while (!reaped_ && poll_once(deadline)) {
  }
  if (!reaped_) {
    ended_.timed_out = true;
    kill(pid_, SIGKILL);
    reap();
  }
  return ended_;
}

Ended run_process(const std::vector<std::string>& argv) {
  return ChildProcess(argv).wait();
}

}  // namespace brachy::test
