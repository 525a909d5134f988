#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <functional>
#include <string>

#include "apps/brachyd/controls.h"
#include "core/scene/scene.h"

namespace brachy {

/// The scene file read again while the daemon runs. One that is not good leaves the old scene in use, and the log says where
/// and why; of a good one is taken up what can change at run time (scene_changes.h), and the log names what takes a restart.
/// Threads: the io thread; the file is read, and the simulator made, on `workers`, which are joined before this ends.
class SceneReload {
 public:
  struct Handlers {
    std::function<Scene()> read;  ///< on a worker; throws UserError
    std::function<void()> begins;
    std::function<void(const std::string& outcome)> ends;  ///< one line
  };

  SceneReload(boost::asio::io_context& io, boost::asio::thread_pool& workers, Controls& controls,
              Handlers handlers)
      : io_(io), workers_(workers), controls_(controls), handlers_(std::move(handlers)) {}

  /// At once, or once what is being prepared is in use.
  void ask();
  /// To be called now and then: begins what was asked for and had to wait.
  void go_on();

  bool is_running() const { return is_running_; }
  std::uint64_t done() const { return done_; }        ///< since start, also those that changed nothing
  std::uint64_t refused() const { return refused_; }  ///< the old scene stayed

 private:
  void compare(const Scene& read);
  void end(const std::string& outcome);
  void refuse(const std::string& why);

  boost::asio::io_context& io_;
  boost::asio::thread_pool& workers_;
  Controls& controls_;
  const Handlers handlers_;
  bool is_asked_ = false, is_running_ = false;
  std::uint64_t done_ = 0, refused_ = 0;
};

}  // namespace brachy
