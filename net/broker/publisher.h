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

/// What a publisher did since start.
struct PublisherStatistics {
  std::uint64_t connections = 0;  ///< to the broker
  std::uint64_t epochs = 0;  ///< times that everything was published anew: connecting, and when a relay asked
  std::uint64_t messages = 0, bytes = 0;  ///< that left, once each, however many read them
  std::uint64_t dropped = 0;              ///< messages that were being sent when the broker went away
};

/// Publishes what a viewer of all points is sent, once, to a broker (net/NATS.md). To the server it is such a viewer: who reads
/// slowly gets newer snapshots instead of older ones, and while the broker is away there is none. One message is on its way to
/// the broker at a time.
///
/// Threads: run() is a thread's whole life, and all that waits for the broker happens on it; all else on the thread that runs
/// `io`, or while neither runs.
class Publisher {
 public:
  /// Who asks for everything anew waits until so long after the last time.
  static constexpr std::int64_t kEpochEveryNs = 1'000'000'000;

  using Log = std::function<void(const std::string&)>;

  /// `server` outlives run(). `options` were checked. `log` is called on the io thread: when the broker comes, and once when it is
  /// away.
  Publisher(boost::asio::io_context& io, Server& server, BrokerOptions options, Log log);
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  void run();                              ///< until stop(); its thread makes libnats' threads
  void stop();                             ///< ends run() within 2 s, whatever the broker does. Threads: any
  PublisherStatistics statistics() const;  ///< once run() has returned

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brachy::net
