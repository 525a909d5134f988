#pragma once

#include <functional>
#include <string>
#include <utility>

#include "core/realtime/deadline.h"
#include "net/session/notice_queue.h"

namespace brachy {

/// The safety events on their way to the log and to every client, with a budget of their own, so that neither other
/// lines nor a peer that causes fault after fault crowd one out. Of a needle's events of one kind that come faster,
/// the newest says how often. Threads: the io thread.
class SafetyNotices {
 public:
  static constexpr double kPerS = 10, kBurst = 40;
  using Out = std::function<void(const net::EventMessage&)>;

  /// `clock` outlives this.
  SafetyNotices(Clock& clock, Out out)
      : clock_(clock),
        queue_(kPerS, kBurst, [out = std::move(out)](net::EventMessage event, std::uint64_t count) {
          if (count > 1) event.text += " (" + std::to_string(count) + " times)";
          out(event);
        }) {}

  void add(net::EventMessage event) {
    const std::string kind = kind_of(event);
    queue_.add(kind, std::move(event), clock_.now_ns());
  }
  void update() { queue_.update(clock_.now_ns()); }
  void end() { queue_.end(); }  ///< passes on all that waits: the daemon ends

 private:
  /// Needle and text, without the peer's name: "armed by …". A few for each needle at most.
  static std::string kind_of(const net::EventMessage& event) {
    return std::to_string(event.needle) + event.text.substr(0, event.text.find(" by "));
  }

  Clock& clock_;
  net::NoticeQueue queue_;
};

}  // namespace brachy
