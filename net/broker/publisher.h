#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "net/broker/broker_options.h"

namespace boost::asio {
class io_context;
}

namespace brachy::net {

class Server;

/// Counts of a publisher since start.
struct PublisherStatistics {
  std::uint64_t connections = 0;          ///< to the broker
  std::uint64_t epochs = 0;               ///< complete publications: on connecting, and when a relay asked
  std::uint64_t messages = 0, bytes = 0;  ///< sent; once each, regardless of the number of relays
  std::uint64_t dropped = 0;              ///< messages being sent when the broker was lost
};

/// Publishes the messages of a viewer of all points, once, to a broker (net/NATS.md). To the server it is such a
/// viewer: when it is slow it gets newer snapshots instead of older ones, and while the broker is away it is not
/// connected. One message is on its way to the broker at a time.
///
/// Threads: run() occupies one thread, the only one that waits for the broker; all else on the thread that runs `io`,
/// or while neither runs.
class Publisher {
 public:
  /// Least time between two complete publications on request.
  static constexpr std::int64_t kEpochEveryNs = 1'000'000'000;

  using Log = std::function<void(const std::string&)>;

  /// `server` outlives run(). `options` were checked. `log` is called on the io thread: when the broker is connected,
  /// and once when it is lost.
  Publisher(boost::asio::io_context& io, Server& server, BrokerOptions options, Log log);
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  void run();                              ///< until stop(); libnats' threads are made on its thread
  void stop();                             ///< ends run() within 2 s in any case. Threads: any
  PublisherStatistics statistics() const;  ///< once run() has returned

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brachy::net
