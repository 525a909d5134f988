#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "net/session/rate_limit.h"
#include "net/wire/messages.h"

namespace brachy::net {

/// The EVENTs that a device came or left, limited in rate: a peer that connects and leaves over and over must not fill
/// every other client's queue. kBurst are sent at once and then kPerS a second; of each needle the newest waits, so
/// that the last one sent is always true. Threads: one.
class DeviceNotices {
 public:
  static constexpr double kPerS = 4, kBurst = 16;

  /// The notices to send now for a new one: itself, or none while it waits.
  std::vector<EventMessage> add(EventMessage notice, std::int64_t now_ns) {
    const auto waiting = std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& other) {
      return other.event.needle == notice.needle;
    });
    if (waiting == waiting_.end()) {
      waiting_.push_back({std::move(notice), 0});
    } else {
      waiting->event = std::move(notice);
      ++waiting->left_out;
    }
    return due(now_ns);
  }

  /// The waiting notices whose turn has come. To be called a few times a second.
  std::vector<EventMessage> due(std::int64_t now_ns) {
    std::vector<EventMessage> events;
    while (!waiting_.empty() && rate_.pass(now_ns)) {
      Waiting next = std::move(waiting_.front());
      waiting_.pop_front();
      if (next.left_out > 0)
        next.event.text += "; " + std::to_string(next.left_out) + " notices before it left out";
      left_out_ += next.left_out;
      events.push_back(std::move(next.event));
    }
    return events;
  }

  std::uint64_t left_out() const { return left_out_; }  ///< since start, of those whose successor was sent

 private:
  struct Waiting {
    EventMessage event;
    std::uint64_t left_out;  // earlier ones of the needle
  };

  RateLimit rate_{kPerS, kBurst};
  std::deque<Waiting> waiting_;  // one a needle at most; oldest first
  std::uint64_t left_out_ = 0;
};

}  // namespace brachy::net
