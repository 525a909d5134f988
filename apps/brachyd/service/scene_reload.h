#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <string>

#include "apps/brachyd/controls.h"
#include "apps/brachyd/service/service_watch.h"
#include "apps/options.h"
#include "core/scene/scene.h"

namespace brachy {

/// The scene file read again at SIGHUP, while the daemon runs. One that is not good leaves the old scene in use, and the
/// log says where and why; of a good one is taken up what can change at run time (scene_changes.h), and the log names what
/// takes a restart.
/// Threads: the io thread; the file is read, and the simulator made, on `workers`, which are joined before this ends.
class SceneReload {
 public:
  /// Everything outlives this. Waits for SIGHUP from here on.
  SceneReload(boost::asio::io_context& io, boost::asio::thread_pool& workers, Controls& controls,
              ServiceWatch& watch, const DaemonOptions& options);

  void stop();  ///< waits for none any more

  /// To be called now and then: begins what was asked for while another model was being prepared.
  void go_on();

  bool is_running() const { return is_running_; }
  std::uint64_t done() const { return done_; }        ///< since start, also those that changed nothing
  std::uint64_t refused() const { return refused_; }  ///< the old scene stayed

 private:
  void await_hangup();
  void compare(const Scene& read);
  void end(const std::string& outcome);
  void refuse(const std::string& why);

  boost::asio::io_context& io_;
  boost::asio::thread_pool& workers_;
  Controls& controls_;
  ServiceWatch& watch_;
  const DaemonOptions options_;
  boost::asio::signal_set hangups_;
  bool is_asked_ = false, is_running_ = false, is_stopped_ = false;
  std::uint64_t done_ = 0, refused_ = 0;
};

}  // namespace brachy
