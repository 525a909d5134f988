#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <thread>

namespace brachy {

/// How a model is set up: what takes long is done on several threads and reports how far it is. The result is the same
/// bits for any number of threads.
struct SetUp {
  static constexpr std::size_t kMaxThreads = 16;  ///< each takes tens of megabytes

  /// Only where the library is built with OpenMP (BRACHY_OPENMP), otherwise one.
  std::size_t threads = std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMaxThreads);
  /// Called with the share that is done, ascending in 0 … 1, from some times to some hundred times; none: not called.
  /// Threads: the caller's. It must not throw.
  std::function<void(double share)> progress;
};

}  // namespace brachy
