#include "net/broker/session_feed.h"

#include <optional>
#include <utility>

#include "net/base/retry.h"
#include "net/broker/nats_link.h"

namespace brachy::net {
namespace {

constexpr std::chrono::milliseconds kWait{100};
constexpr std::int64_t kAskEveryNs = 1'000'000'000;
// A daemon with nothing new still sends its STATE twice a second.
constexpr std::int64_t kSilenceNs = 5'000'000'000;
constexpr std::uint32_t kMaxMessageBytes = 256u << 20;  // as of a Client

class SessionFeed {
 public:
  SessionFeed(const BrokerOptions& options, const FeedHandlers& handlers, Clock& clock)
      : options_(options), handlers_(handlers), clock_(clock) {}

  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const std::int64_t now_ns = clock_.now_ns();
      if (link_ && !link_->is_up()) disconnect("the broker is gone");
      if (!link_ && retry_.is_due(now_ns)) connect();
      if (!link_) {
        clock_.sleep_until_ns(now_ns + in_ns(kWait));
        continue;
      }
      if (now_ns - heard_ns_ >= kSilenceNs) chunks_.lose();
      if (chunks_.is_waiting() && now_ns - asked_ns_ >= kAskEveryNs) ask(now_ns);
      if (const auto payload = link_->next(kWait)) take(*payload);
    }
  }

 private:
  void connect() {
    try {
      link_.emplace(options_, options_.stream_subject());
    } catch (const std::exception& e) {
      return disconnect(e.what());
    }
    retry_.connected();
    was_lost_ = false;
    chunks_.lose();  // chunks sent meanwhile were missed
    handlers_.on_broker(true, {});
  }

  void disconnect(const std::string& why) {
    link_.reset();
    retry_.failed(clock_.now_ns());
    if (!std::exchange(was_lost_, true)) handlers_.on_broker(false, why);
  }

  void ask(std::int64_t now_ns) {
    asked_ns_ = heard_ns_ = now_ns;
    link_->publish(options_.ask_subject(), {});
    handlers_.on_asked();
  }

  void take(const Bytes& payload) {
    const auto taken = chunks_.take(payload);
    if (taken != ChunkAssembler::Taken::kLeftOut) heard_ns_ = clock_.now_ns();
    if (taken == ChunkAssembler::Taken::kMessage && !handlers_.on_message(chunks_.message())) chunks_.lose();
  }

  const BrokerOptions& options_;
  const FeedHandlers& handlers_;
  Clock& clock_;
  std::optional<NatsLink> link_;
  ConnectRetry retry_;
  ChunkAssembler chunks_{kMaxMessageBytes};
  std::int64_t asked_ns_ = -kAskEveryNs, heard_ns_ = 0;
  bool was_lost_ = false;
};

}  // namespace

void run_session_feed(const std::stop_token& stop, const BrokerOptions& options, const FeedHandlers& handlers,
                      Clock& clock) {
  SessionFeed(options, handlers, clock).run(stop);
}

}  // namespace brachy::net
