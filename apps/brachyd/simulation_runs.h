#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "apps/brachyd/simulation_run.h"
#include "core/realtime/triple_buffer.h"

namespace brachy {

/// The simulation that is in use, and the one that is to come after it: made on `workers`, handed to the deformation thread
/// through a triple buffer, and the old one freed once a snapshot shows the new one.
/// Threads: the io thread, but for what is said otherwise. `workers` are joined before this ends.
class SimulationRuns {
 public:
  SimulationRuns(std::shared_ptr<SimulationRun> first, boost::asio::io_context& io,
                 boost::asio::thread_pool& workers)
      : io_(io), workers_(workers), in_use_(std::move(first)) {}

  /// Before the threads start and after they have ended also from elsewhere.
  SimulationRun& in_use() { return *in_use_; }
  TripleBuffer<SimulationRun*>::Reader& reader() { return reader_; }  ///< deformation thread

  /// One is being made: `workers` will be done only then.
  bool is_making() const { return is_preparing_ && !next_; }
  /// Asked for and not yet in use.
  bool is_preparing() const { return is_preparing_; }

  /// Makes a simulator of `scene`, which has the first one's tissue. `on_failure` is told why there is none, and the old one
  /// goes on. Precondition: not is_preparing().
  void begin(const Scene& scene, bool goes_on, std::function<void(const std::string&)> on_failure);

  /// A snapshot of this run was taken. True if it is a new one.
  bool seen(std::uint64_t run);

 private:
  boost::asio::io_context& io_;
  boost::asio::thread_pool& workers_;
  std::shared_ptr<SimulationRun> in_use_, next_;
  bool is_preparing_ = false;
  TripleBuffer<SimulationRun*> handed_;
  TripleBuffer<SimulationRun*>::Writer writer_ = handed_.writer();
  TripleBuffer<SimulationRun*>::Reader reader_ = handed_.reader();
};

}  // namespace brachy
