#pragma once

#include <cstdint>
#include <deque>
#include <functional>

#include "apps/daemon/io/event_loop.h"

namespace brachy {

/// Work that peers cause and that may take longer than the io thread may: on a worker, one after the other. A peer has
/// one piece at a time, so that the others come before its next one, and no more waits than there are peers.
/// Threads: the io thread; a Work runs on the worker, which is ended before this is destroyed.
class WorkTurns {
 public:
  using Finish = std::function<void()>;  ///< on the io thread, once the work is done
  using Work = std::function<Finish()>;  ///< on the worker; must not throw
  using Prepare =
      std::function<Work()>;  ///< on the io thread, at its turn; null where there is nothing to do

  /// Both outlive this.
  WorkTurns(EventLoop& loop, Worker& worker) : loop_(loop), worker_(worker) {}

  /// False, and nothing is done, where `peer` has work that waits or runs.
  bool add(std::uint64_t peer, Prepare prepare);
  bool is_empty() const { return waiting_.empty(); }

 private:
  void begin();

  struct Piece {
    std::uint64_t peer;
    Prepare prepare;
  };
  EventLoop& loop_;
  Worker& worker_;
  std::deque<Piece> waiting_;  // the first one runs
};

}  // namespace brachy
