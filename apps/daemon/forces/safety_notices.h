#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <utility>

#include "core/realtime/deadline.h"
#include "net/session/rate_limit.h"
#include "net/wire/messages.h"

namespace brachy {

/// The safety events on their way to the log and to every client, with a budget of their own, so that neither other
/// lines nor a peer that causes fault after fault crowd one out: kBurst pass at once, then kPerS a second. Of a
/// needle's events of one kind that come faster, the newest waits and says how often: none is lost without being
/// counted. Threads: the io thread.
class SafetyNotices {
 public:
  static constexpr double kPerS = 10, kBurst = 40;
  using Out = std::function<void(const net::EventMessage&)>;

  explicit SafetyNotices(Out out) : out_(std::move(out)) {}

  void add(net::EventMessage event, std::int64_t now_ns = monotonic_ns()) {
    const std::string kind = kind_of(event);
    for (Waiting& waiting : waiting_) {
      if (waiting.kind != kind) continue;
      waiting.event = std::move(event);
      ++waiting.count;
      return update(now_ns);
    }
    waiting_.push_back({kind, std::move(event), 1});
    update(now_ns);
  }

  /// Passes on what waits, as far as the rate allows. To be called a few times a second.
  void update(std::int64_t now_ns = monotonic_ns()) {
    while (!waiting_.empty() && rate_.pass(now_ns)) pass_first();
  }
  /// Passes on all that waits: the daemon ends.
  void end() {
    while (!waiting_.empty()) pass_first();
  }

 private:
  struct Waiting {
    std::string kind;
    net::EventMessage event;
    std::uint64_t count;
  };

  /// Needle and text, without the peer's name: "armed by …".
  static std::string kind_of(const net::EventMessage& event) {
    return std::to_string(event.needle) + event.text.substr(0, event.text.find(" by "));
  }

  void pass_first() {
    Waiting first = std::move(waiting_.front());
    waiting_.pop_front();
    if (first.count > 1) first.event.text += " (" + std::to_string(first.count) + " times)";
    out_(first.event);
  }

  Out out_;
  net::RateLimit rate_{kPerS, kBurst};
  std::deque<Waiting> waiting_;  // by needle and kind, oldest first: a few for each needle at most
};

}  // namespace brachy
