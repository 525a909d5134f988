#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/wait.h"

namespace brachy::test {

/// A file descriptor that closes itself.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) : fd_(fd) {}
  ~FileDescriptor() { reset(); }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }
  bool is_open() const { return fd_ >= 0; }
  void reset(int fd = -1);
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

/// How a process ended.
struct Ended {
  int exit_code = -1;      ///< -1: it did not exit by itself
  int signal = 0;          ///< that killed it, 0 = none
  bool timed_out = false;  ///< it was still running at the deadline; it has been killed then
  std::string out, err;    ///< all it wrote
};

/// Lines of a text; text after the last line break counts as a line.
std::vector<std::string> lines_of(const std::string& text);

/// A process with its stdout and stderr on pipes and nothing on stdin. The destructor kills it, by its pid, if it
/// still runs, and reaps it. Waits are for conditions, until kDeadline; nothing sleeps.
class ChildProcess {
 public:
  /// Where its output goes instead of a pipe; -1: to the pipe.
  struct Output {
    int out = -1, err = -1;
  };

  /// `argv[0]` is the program's path. Throws std::runtime_error where it cannot be started.
  explicit ChildProcess(const std::vector<std::string>& argv) : ChildProcess(argv, Output()) {}
  ChildProcess(const std::vector<std::string>& argv, Output output);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// The next line of its stdout without the line break; nothing where none comes before its end or the deadline.
  std::optional<std::string> read_line();

  /// Waits until its stderr contains `text` so many times; false at its end or the deadline.
  bool says(const std::string& text, std::size_t times = 1);

  void send_signal(int number);

  /// Waits for its end, reading both pipes meanwhile.
  Ended wait();

  pid_t pid() const { return pid_; }
  bool is_running() const { return !reaped_; }  ///< not yet waited for

 private:
  bool poll_once(const Deadline& deadline);
  void reap();

  pid_t pid_ = -1;
  FileDescriptor out_, err_, pidfd_;
  bool reaped_ = false;
  std::size_t lines_read_ = 0;  // bytes of ended_.out that read_line has given out
  Ended ended_;
};

/// Starts a program, waits for its end.
Ended run_process(const std::vector<std::string>& argv);

}  // namespace brachy::test
