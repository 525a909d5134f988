#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "net/base/clock.h"
#include "net/transport/tls/handshake_limit.h"

namespace brachy::net {

/// Runs a function on a thread of its own, one after the other; it may drop them once the program ends.
using HandshakeThread = std::function<void(std::function<void()>)>;

/// The order of a server's TLS handshakes, on all its ports, and where they are computed. A peer makes the server sign
/// by sending one ClientHello, so that not all may be answered: one begins after the other, as far as HandshakeLimit
/// allows. The next one is the newest of an origin drawn at random. So a flood delays no other origin; and one of its
/// own origin is answered while its peer still waits, as it would not be behind all that came before. Steps run on the
/// handshake thread, so that no force waits for one; without such a thread on the io thread, and then far fewer begin.
/// Threads: the io thread.
class HandshakeTurns : public std::enable_shared_from_this<HandshakeTurns> {
 public:
  /// Share of a thread's time for handshakes: of their own thread's, or of the io thread's.
  static constexpr double kShareOfOwnThread = 0.5, kShareOfIoThread = 0.02;

  HandshakeTurns(boost::asio::io_context& io, TimerClock& clock, HandshakeThread thread);

  /// `begin` is called when its turn has come, from here or later, and calls compute() for its first step; false where
  /// its peer has left: then it is another's turn. Returns what forget() wants.
  std::uint64_t wait(const std::string& origin, std::function<bool()> begin);
  void forget(std::uint64_t ticket);

  enum class Step { kFirst, kLater };
  /// Runs `step` on the handshake thread and then `done` on the io thread. Neither may own what belongs to the io
  /// thread: they may be destroyed on the other one.
  void compute(Step which, std::function<void()> step, std::function<void()> done);

  std::uint64_t begun() const { return begun_; }  ///< since start

 private:
  struct Waiting {
    std::uint64_t ticket;
    std::string origin;
    std::function<bool()> begin;
  };

  void begin_next();
  Waiting take_next();
  void on_computed(Step which, std::int64_t ns);

  boost::asio::io_context& io_;
  HandshakeLimit limit_;
  const HandshakeThread thread_;
  TimerClock& clock_;
  const std::unique_ptr<Timer> timer_;
  std::vector<Waiting> waiting_;  // oldest first; as many as the gate lets in before HELLO
  std::minstd_rand random_;
  std::uint64_t last_ticket_ = 0, begun_ = 0;
  bool is_beginning_ = false;  // a first step is being computed, or waits for the timer
};

}  // namespace brachy::net
