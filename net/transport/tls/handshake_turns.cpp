#include "net/transport/tls/handshake_turns.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <set>
#include <utility>

namespace brachy::net {
namespace asio = boost::asio;
namespace {

constexpr std::chrono::milliseconds kRetry{5};  // where the limit is reached

}  // namespace

HandshakeTurns::HandshakeTurns(asio::io_context& io, TimerClock& clock, HandshakeThread thread)
    : io_(io),
      limit_(thread ? kShareOfOwnThread : kShareOfIoThread),
      thread_(thread ? std::move(thread)
                     : [&io](std::function<void()> work) { asio::post(io, std::move(work)); }),
      clock_(clock),
      timer_(clock.make_timer(io)) {}

std::uint64_t HandshakeTurns::wait(const std::string& origin, std::function<bool()> begin) {
  waiting_.push_back({++last_ticket_, origin, std::move(begin)});
  const std::uint64_t ticket = last_ticket_;
  begin_next();
  return ticket;
}

void HandshakeTurns::forget(std::uint64_t ticket) {
  std::erase_if(waiting_, [&](const Waiting& waiting) { return waiting.ticket == ticket; });
}

void HandshakeTurns::begin_next() {
  while (!is_beginning_ && !waiting_.empty()) {
    if (!limit_.may_begin(clock_.now_ns())) {
      is_beginning_ = true;
      timer_->start(kRetry, [weak = weak_from_this()] {
        const auto self = weak.lock();
        if (!self) return;
        self->is_beginning_ = false;
        self->begin_next();
      });
      return;
    }
    const Waiting next = take_next();
    is_beginning_ = true;
    if (next.begin())
      ++begun_;
    else
      is_beginning_ = false;
  }
}

HandshakeTurns::Waiting HandshakeTurns::take_next() {
  std::set<std::string> origins;
  for (const Waiting& waiting : waiting_) origins.insert(waiting.origin);
  const auto drawn = std::next(origins.begin(), static_cast<std::ptrdiff_t>(random_() % origins.size()));
  const auto newest = std::find_if(waiting_.rbegin(), waiting_.rend(),
                                   [&](const Waiting& waiting) { return waiting.origin == *drawn; });
  Waiting next = std::move(*newest);
  waiting_.erase(std::next(newest).base());
  return next;
}

void HandshakeTurns::compute(Step which, std::function<void()> step, std::function<void()> done) {
  thread_(
      [&io = io_, weak = weak_from_this(), which, step = std::move(step), done = std::move(done)]() mutable {
        const std::int64_t begin_ns = thread_cpu_ns();
        step();
        const std::int64_t ns = thread_cpu_ns() - begin_ns;
        asio::post(io, [weak = std::move(weak), which, ns, done = std::move(done)] {
          if (const auto self = weak.lock()) self->on_computed(which, ns);
          done();
        });
      });
}

void HandshakeTurns::on_computed(Step which, std::int64_t ns) {
  if (which == Step::kLater) return limit_.spent_later(ns);
  limit_.spent(ns);
  is_beginning_ = false;
  begin_next();
}

}  // namespace brachy::net
