#include "net/broker/publisher.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <random>
#include <utility>

#include "net/base/clock.h"
#include "net/base/retry.h"
#include "net/broker/chunks.h"
#include "net/broker/in_process_viewer.h"
#include "net/broker/nats_link.h"
#include "net/server/server.h"

namespace brachy::net {
namespace asio = boost::asio;
namespace {

constexpr std::chrono::milliseconds kPeriod{100};  // between checks of the connection and of requests
constexpr int kMaxAsked = 1000;  // requests taken at one check: a flood of them does not occupy this thread
// A link that writes less than this within NatsLink::kWriteTimeout is lost.
constexpr std::size_t kMaxPayload = 256 * 1024;

std::uint64_t random_number() {
  std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}

}  // namespace

class Publisher::Impl {
 public:
  Impl(asio::io_context& io, Server& server, BrokerOptions options, Log log)
      : io_(io),
        server_(server),
        clock_(*server.options().clock),
        options_(std::move(options)),
        log_(std::move(log)) {}

  ~Impl() {
    if (viewer_) viewer_->leave();
  }

  void run() {
    watch();
    broker_.run();
    link_.reset();
  }
  void stop() { broker_.stop(); }
  const PublisherStatistics& statistics() const { return statistics_; }

 private:
  // --- on the broker's thread ---

  void watch() {
    const std::int64_t now_ns = clock_.now_ns();
    if (link_ && !link_->is_up()) disconnect("the broker is gone");
    if (!link_ && retry_.is_due(now_ns)) connect();
    for (int i = 0; i < kMaxAsked && link_ && link_->next(std::chrono::milliseconds(0)); ++i)
      is_asked_ = true;
    if (link_ && is_asked_ && clock_.now_ns() - epoch_ns_ >= kEpochEveryNs) begin_epoch();
    timer_->start(kPeriod, [this] { watch(); });
  }

  void disconnect(const std::string& why) {
    link_.reset();
    retry_.failed(clock_.now_ns());
    on_io([this, why] { lose(why); });
  }

  void connect() {
    try {
      link_.emplace(options_, options_.ask_subject());
    } catch (const std::exception& e) {
      return disconnect(e.what());
    }
    retry_.connected();
    ++statistics_.connections;
    on_io([this] { come(); });
    begin_epoch();
  }

  void begin_epoch() {
    is_asked_ = false;
    epoch_ns_ = clock_.now_ns();
    ++epoch_;
    sequence_ = 0;
    ++statistics_.epochs;
    on_io([this, epoch = epoch_] { begin(epoch); });
  }

  void send(std::uint64_t epoch, const Bytes& header, const Bytes& body) {
    if (epoch != epoch_ || !link_) return;
    const bool is_sent = send_chunks({publisher_, epoch, ++sequence_, 0, 0}, header, body,
                                     std::min(link_->max_payload(), kMaxPayload), chunk_,
                                     [this](std::span<const std::byte> payload) {
                                       return link_->publish(options_.stream_subject(), payload);
                                     });
    if (is_sent) {
      ++statistics_.messages;
      statistics_.bytes += header.size() + body.size();
      return;
    }
    ++statistics_.dropped;
    disconnect(
        "the broker does not read");  // part of a message may have been sent: only a new connection can go on
  }

  template <class F>
  void on_io(F&& f) {
    asio::post(io_, std::forward<F>(f));
  }

  // --- on the io thread ---

  /// A viewer that joins now is sent everything, and changes from then on.
  void begin(std::uint64_t epoch) {
    if (viewer_) viewer_->leave();
    viewer_ = std::make_shared<InProcessViewer>(
        clock_, "broker " + shown_url(options_), kSubscribePoseHistory | kSubscribeScene | kSubscribePlan,
        [this](std::function<void()> f) { on_io(std::move(f)); },
        [this, epoch](Bytes header, std::shared_ptr<const Bytes> body) {
          hand_over(epoch, std::move(header), std::move(body));
        },
        [this] { asio::post(broker_, [this] { is_asked_ = true; }); });
    server_.adopt_own(viewer_);
  }

  void hand_over(std::uint64_t epoch, Bytes header, std::shared_ptr<const Bytes> body) {
    asio::post(broker_, [this, epoch, viewer = viewer_, header = std::move(header), body = std::move(body)] {
      send(epoch, header, *body);
      on_io([viewer] { viewer->done(); });
    });
  }

  void lose(const std::string& why) {
    if (viewer_) viewer_->leave();
    viewer_ = nullptr;
    if (std::exchange(was_lost_, true)) return;
    say(why + "; nothing is published until it is there");
  }

  void come() {
    was_lost_ = false;
    say("connected");
  }

  void say(const std::string& what) {
    log_("broker " + shown_url(options_) + ", session " + options_.session + ": " + what);
  }

  asio::io_context& io_;
  Server& server_;
  TimerClock& clock_;
  const BrokerOptions options_;
  const Log log_;
  std::shared_ptr<InProcessViewer> viewer_;  // io thread; null: no broker
  bool was_lost_ = false;                    // io thread: it was logged

  asio::io_context broker_{1};  // this and what follows: the broker's thread
  const std::unique_ptr<Timer> timer_ = clock_.make_timer(broker_);
  std::optional<NatsLink> link_;
  ConnectRetry retry_;
  const std::uint64_t publisher_ = random_number();
  std::uint64_t epoch_ = 0, sequence_ = 0;
  std::int64_t epoch_ns_ = 0;
  bool is_asked_ = false;
  Bytes chunk_;
  PublisherStatistics statistics_;
};

Publisher::Publisher(asio::io_context& io, Server& server, BrokerOptions options, Log log)
    : impl_(std::make_unique<Impl>(io, server, std::move(options), std::move(log))) {}
Publisher::~Publisher() = default;
void Publisher::run() {
  impl_->run();
}
void Publisher::stop() {
  impl_->stop();
}
PublisherStatistics Publisher::statistics() const {
  return impl_->statistics();
}

}  // namespace brachy::net
