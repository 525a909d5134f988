#pragma once

#include <sys/ptrace.h>
#include <sys/wait.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace brachy::test {

/// Stops one thread of a child process while this object lives: a loop that hangs, in a program whose other threads
/// run. Construct and destroy it on one thread.
class StoppedThread {
 public:
  StoppedThread(pid_t process, const std::string& name) : thread_(find(process, name)) {
    if (thread_ <= 0 || ::ptrace(PTRACE_SEIZE, thread_, nullptr, nullptr) != 0) return;
    int status = 0;
    is_stopped_ = ::ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr) == 0 &&
                  ::waitpid(thread_, &status, __WALL) == thread_ && WIFSTOPPED(status);
  }
  ~StoppedThread() { go_on(); }
  StoppedThread(const StoppedThread&) = delete;
  StoppedThread& operator=(const StoppedThread&) = delete;

  bool is_found() const { return thread_ > 0; }
  bool is_stopped() const { return is_stopped_; }  ///< false: the system does not allow it
  void go_on() {
    if (is_stopped_) ::ptrace(PTRACE_DETACH, thread_, nullptr, nullptr);
    is_stopped_ = false;
  }

 private:
  static pid_t find(pid_t process, const std::string& name) {
    for (const auto& task :
         std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
      std::string its_name;
      std::getline(std::ifstream(task.path() / "comm"), its_name);
      if (its_name == name) return static_cast<pid_t>(std::stoi(task.path().filename().string()));
    }
    return 0;
  }

  const pid_t thread_;
  bool is_stopped_ = false;
};

}  // namespace brachy::test
