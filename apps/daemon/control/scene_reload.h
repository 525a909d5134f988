#pragma once

#include <cstdint>
#include <string>

#include "apps/command_line/options.h"
#include "apps/daemon/control/controls.h"
#include "apps/daemon/io/event_loop.h"
#include "core/scene/scene.h"

namespace brachy {

class ServiceWatch;

/// Configuration reload: reads the scene file again at SIGHUP while the daemon runs. A file with errors
/// leaves the old scene in use, and the log says where and why. Of a valid one the keys that can change at
/// run time (scene_changes.h) are applied, and the log names those that need a restart.
/// Threads: the io thread; the file is read and the simulator built on `worker`, which is ended before this
/// is destroyed.
class SceneReload {
 public:
  /// All arguments outlive this. Waits for SIGHUP from here on.
  SceneReload(EventLoop& loop, Worker& worker, Controls& controls, ServiceWatch& watch,
              const DaemonOptions& options);

  void stop();  ///< ignores further signals

  /// Begins a reload that was requested while another model was being prepared. Called with every snapshot.
  void begin_if_requested();

  bool is_running() const { return is_running_; }
  std::uint64_t done() const { return done_; }        ///< since start, including those that changed nothing
  std::uint64_t refused() const { return refused_; }  ///< the old scene stayed

 private:
  void await_hangup();
  void compare(const Scene& read);
  void end(const std::string& outcome);
  void refuse(const std::string& why);

  EventLoop& loop_;
  Worker& worker_;
  Controls& controls_;
  ServiceWatch& watch_;
  const DaemonOptions options_;
  SignalWait hangups_;
  bool is_requested_ = false, is_running_ = false, is_stopped_ = false;
  std::uint64_t done_ = 0, refused_ = 0;
};

}  // namespace brachy
