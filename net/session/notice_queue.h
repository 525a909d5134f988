#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <utility>

#include "net/base/rate_limit.h"
#include "net/wire/messages.h"

namespace brachy::net {

/// EVENTs that peers cause, limited in rate: `burst` pass at once, then `per_s` a second. Of those of one key that come
/// faster only the newest waits, so that the last one passed on is always true, and none is lost without being counted.
/// Threads: one.
class NoticeQueue {
 public:
  /// `count`: of this key since the last one passed on, itself included.
  using Out = std::function<void(EventMessage event, std::uint64_t count)>;

  NoticeQueue(double per_s, double burst, Out out) : rate_(per_s, burst), out_(std::move(out)) {}

  void add(const std::string& key, EventMessage event, std::int64_t now_ns) {
    const auto same = std::find_if(waiting_.begin(), waiting_.end(),
                                   [&](const Waiting& other) { return other.key == key; });
    if (same == waiting_.end()) {
      waiting_.push_back({key, std::move(event), 1});
    } else {
      same->event = std::move(event);
      ++same->count;
    }
    update(now_ns);
  }

  /// Passes on what waits, as far as the rate allows. To be called a few times a second.
  void update(std::int64_t now_ns) {
    while (!waiting_.empty() && rate_.pass(now_ns)) pass_first();
  }
  /// Passes on all that waits.
  void end() {
    while (!waiting_.empty()) pass_first();
  }

 private:
  struct Waiting {
    std::string key;
    EventMessage event;
    std::uint64_t count;
  };

  void pass_first() {
    Waiting first = std::move(waiting_.front());
    waiting_.pop_front();
    out_(std::move(first.event), first.count);
  }

  RateLimit rate_;
  Out out_;
  std::deque<Waiting> waiting_;  // one a key, oldest first
};

}  // namespace brachy::net
